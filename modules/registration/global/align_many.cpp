// SPDX-License-Identifier: MIT
module;
#include <ostream>
module cilantro.registration;

import cilantro.eigen;
import :pair_fit;
import :surface_check;
import :surface_description;
import :surface_fit;

namespace cilantro {
namespace {

/// What two scans say of each other.
template <int D>
struct scan_link {
  scan_pair pair;
  std::optional<pose_edge<D>> edge;
};

template <int D>
class scan_graph {
 public:
  scan_graph(std::vector<std::shared_ptr<const surface_description>> scans,
             const align_many_options& options)
      : scans_{std::move(scans)},
        options_{options},
        monitor_{in_passes(options.monitor, options.initial.empty() ? 2 : 1)} {}

  [[nodiscard]] align_many_result<D> run() {
    if (options_.initial.empty())
      link_globally();
    else
      for (const auto& pose : options_.initial)
        poses_.push_back(pose.as<rigid_transform<double, D>>(
            D, "align_many: initial poses must have the dimension of the scans"));
    if (poses_.empty()) optimize(std::nullopt);
    close_loops();
    auto result = optimize(poses_);
    for (auto& link : links_) result.pairs.push_back(link.pair);
    return result;
  }

 private:
  [[nodiscard]] index_t size() const { return std::ssize(scans_); }
  [[nodiscard]] const voxel_surface<D>& surface(index_t i) const {
    if constexpr (D == 2)
      return *scans_[i]->flat;
    else
      return *scans_[i]->solid;
  }

  /// Looks at pairs side by side, each on one thread, and keeps what `look` finds of them.
  template <class F>
  void for_each_pair(const std::vector<std::pair<index_t, index_t>>& pairs, F look) {
    std::vector<std::optional<scan_link<D>>> found(pairs.size());
    parallel_blocks(
        std::ssize(pairs), 1, {options_.threads, monitor_},
        [&](index_t k, index_t, index_t) { found[k] = look(pairs[k].first, pairs[k].second); });
    if (pairs.empty() && monitor_.progress) monitor_.progress(1);
    for (auto& link : found)
      if (link) links_.push_back(std::move(*link));
  }

  void link_globally() {
    std::vector<std::pair<index_t, index_t>> all;
    for (index_t target = 0; target < size(); ++target)
      for (index_t source = target + 1; source < size(); ++source) all.push_back({source, target});
    for_each_pair(all, [&](index_t source, index_t target) -> std::optional<scan_link<D>> {
      const auto found = align_descriptions(*scans_[source], *scans_[target],
                                            {.threads = 1, .monitor = {{}, options_.monitor.stop}});
      if (found.status == global_status::cancelled) throw cancelled{};
      scan_link<D> link{{source, target, found.status, found.overlap}, std::nullopt};
      if (found.status == global_status::unique) {
        const auto& best = found.candidates.front();
        link.edge = edge_of(
            source, target,
            make_transform<rigid_transform<double, D>>(best.linear, best.translation), found);
      }
      return link;
    });
  }

  [[nodiscard]] pose_edge<D> edge_of(index_t source, index_t target,
                                     const rigid_transform<double, D>& transform,
                                     const alignment_fit& fit) const {
    pose_edge<D> edge{.source = source, .target = target, .transform = transform};
    // Equal scans fit exactly, but no sensor is that precise.
    edge.information =
        information_of(fit, {.noise = std::max(fit.residual, 0.01 * options_.voxel)});
    return edge;
  }

  /// Optimises the poses, from a start or from the edges alone.
  align_many_result<D> optimize(
      const std::optional<std::vector<rigid_transform<double, D>>>& start) {
    std::vector<pose_edge<D>> edges;
    for (auto& link : links_) {
      link.pair.edge = link.edge ? std::ssize(edges) : -1;
      if (link.edge) edges.push_back(*link.edge);
    }
    const pose_graph_options how{.robust = options_.robust,
                                 .threads = options_.threads,
                                 .monitor = {{}, options_.monitor.stop}};
    align_many_result<D> result;
    static_cast<pose_graph_result<rigid_transform<double, D>>&>(result) =
        start ? optimize_poses(*start, edges, how) : optimize_poses(size(), edges, how);
    if (result.status == pose_graph_status::cancelled) throw cancelled{};
    poses_ = result.poses;
    components_ = result.component_of;
    return result;
  }

  /// Aligns pairs that overlap where the scans are now, but are no edges yet.
  void close_loops() {
    std::map<std::pair<index_t, index_t>, scan_link<D>> known;
    for (auto& link : links_) known[{link.pair.source, link.pair.target}] = std::move(link);
    std::vector<std::pair<index_t, index_t>> open;
    for (index_t target = 0; target < size(); ++target)
      for (index_t source = target + 1; source < size(); ++source) {
        const auto link = known.find({source, target});
        const bool is_edge = link != known.end() && link->second.edge;
        if (!is_edge && (components_.empty() || components_[source] == components_[target]))
          open.push_back({source, target});
      }
    links_.clear();
    for_each_pair(open, [&](index_t s, index_t t) { return link_near(s, t); });
    for (auto& link : links_) known[{link.pair.source, link.pair.target}] = std::move(link);
    links_.clear();
    for (auto& [pair, link] : known) links_.push_back(std::move(link));
  }

  /// Aligns two scans from where they are, if they overlap there.
  [[nodiscard]] std::optional<scan_link<D>> link_near(index_t s, index_t t) const {
    const auto &source = surface(s), &target = surface(t);
    if (source.points.cols() == 0 || target.points.cols() == 0) return std::nullopt;
    const rigid_transform<double, D> guess = poses_[t].inverse() * poses_[s];
    pair_proposal<D> proposal;
    proposal.rotation = guess.linear();
    proposal.translation = guess * point_vector<double, D>{source.center} - target.center;
    const surface_check<D> onto{source, target, options_.voxel, scans_[s]->oriented, 1},
        back{target, source, options_.voxel, scans_[s]->oriented, 1};
    const auto overlap_of = [&](const pair_proposal<D>& there) {
      pair_proposal<D> inverse;
      inverse.rotation = there.rotation.transpose();
      inverse.translation = -(inverse.rotation * there.translation);
      return std::min(onto.compare(there, 4).overlap(), back.compare(inverse, 4).overlap());
    };
    // Where poses are off by some voxels, less agrees than will.
    if (overlap_of(proposal) < options_.min_overlap / 3) return std::nullopt;
    const settle_options how{.voxel = options_.voxel,
                             .max_distance = 3 * options_.voxel,
                             .threads = 1,
                             .stop = options_.monitor.stop};
    auto settled = settle<D>(source, target, proposal, {}, how);
    if (!settled) return std::nullopt;
    settle_options finer = how;
    finer.max_distance = options_.voxel;
    settled = settle<D>(source, target, settled->first, {}, finer);
    if (!settled) return std::nullopt;
    const auto& [found, fit] = *settled;
    const double overlap = overlap_of(found);
    if (overlap < options_.min_overlap) return std::nullopt;
    const auto evidence = onto.compare(found, 1);
    if (evidence.contradicted_share() > most_contradicted) return std::nullopt;
    const auto map = between_origins<D>(found, source.center, target.center);
    const auto local = around_origin<D>(fit, target.center);
    return scan_link<D>{
        {s, t, fit.undetermined > 0 ? global_status::degenerate : global_status::unique, overlap},
        edge_of(s, t, make_transform<rigid_transform<double, D>>(map.linear(), map.translation()),
                local)};
  }

  std::vector<std::shared_ptr<const surface_description>> scans_;
  const align_many_options& options_;
  task_monitor monitor_;  ///< Of all pairs, in one or two passes.
  std::vector<scan_link<D>> links_;
  std::vector<rigid_transform<double, D>> poses_;
  index_list components_;
};

}  // namespace

template <Scalar S, int D>
align_many_result<D> closed_align_many(const std::vector<global_input<S, D>>& scans,
                                       const align_many_options& options) {
  expects(options.initial.empty() || options.initial.size() == scans.size(),
          "align_many: there must be one initial pose per scan, or none");
  expect_between(0, options.min_overlap, 1, "align_many: min_overlap");
  std::vector<std::shared_ptr<const surface_description>> described;
  for (const auto& scan : scans)
    described.push_back(closed_describe(scan, {.voxel = options.voxel,
                                               .oriented = options.oriented,
                                               .viewpoint = options.viewpoint,
                                               .threads = options.threads,
                                               .monitor = {{}, options.monitor.stop}}));
  return scan_graph<D>{std::move(described), options}.run();
}

void print_pairs(std::ostream& out, const std::vector<scan_pair>& pairs) {
  const auto count = [&](global_status status) {
    return std::ranges::count(pairs, status, &scan_pair::status);
  };
  out << pairs.size() << " pairs of scans: " << count(global_status::unique) << " unique, "
      << count(global_status::degenerate) << " degenerate, " << count(global_status::ambiguous)
      << " ambiguous, " << count(global_status::too_few) << " too few";
}

template align_many_result<2> closed_align_many(const std::vector<global_input<float, 2>>&,
                                                const align_many_options&);
template align_many_result<3> closed_align_many(const std::vector<global_input<float, 3>>&,
                                                const align_many_options&);
template align_many_result<2> closed_align_many(const std::vector<global_input<double, 2>>&,
                                                const align_many_options&);
template align_many_result<3> closed_align_many(const std::vector<global_input<double, 3>>&,
                                                const align_many_options&);

}  // namespace cilantro
