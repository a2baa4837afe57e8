// SPDX-License-Identifier: MIT
module cilantro.tiles;

import cilantro.eigen;
import cilantro.search;
import cilantro.registration;
import :ranks;
import :rigid_equations;
import :running;
import :survey;
import :survey_around;
import :tile_sums;

namespace cilantro {
namespace {

/// Points of the target, in double, that are ready to be searched.
template <int D>
struct near_points {
  point_matrix<double, D> points, normals;
  std::optional<kd_tree<double, D>> tree;  ///< None without points.

  [[nodiscard]] std::uint64_t bytes() const {
    return static_cast<std::uint64_t>(points.size() + normals.size()) * sizeof(double) +
           (tree ? tree->memory() : 0);
  }
};

template <Scalar S, int D>
near_points<D> ready(const point_cloud<S, D>& cloud, bool with_normals) {
  near_points<D> near;
  if (cloud.empty()) return near;
  near.points = cloud.points.template cast<double>();
  near.tree.emplace(near.points);
  if (!with_normals) return near;
  expects(cloud.has_normals(),
          "align: some tiles of the target have normals, and others have none");
  near.normals = cloud.normals.template cast<double>();
  for (index_t i = 0; i < near.normals.cols(); ++i) {
    const double square = near.normals.col(i).squaredNorm();
    // Zero or NaN: it is unknown.
    expects(!(square > 0) || std::abs(square - 1) <= 0.02,
            "align: the normals of the target must have unit length");
  }
  return near;
}

/// Finds the partners of places, and adds the pairs up.
template <Scalar S, int D>
class pair_adder {
 public:
  pair_adder(const survey_around<S, D>& target, const align_options& options,
             const point_vector<double, D>& center)
      : target_{target},
        is_plane_{std::holds_alternative<point_to_plane>(options.metric)},
        is_robust_{static_cast<bool>(options.robust)},
        plane_{point_to_plane{}, 1, unit_weight{}, options.robust},
        point_{point_to_point{}, 1, unit_weight{}, options.robust},
        center_{center},
        stop_{options.monitor.stop} {}

  [[nodiscard]] const survey_around<S, D>& target() const { return target_; }
  [[nodiscard]] const std::stop_token& stop() const { return stop_; }
  [[nodiscard]] bool is_in_closed_form() const { return !is_plane_ && !is_robust_; }
  [[nodiscard]] near_points<D> load(const tile_key& square) const {
    return ready(target_.around(square, stop_), is_plane_);
  }

  /// For some places, which are moved already.
  void add(const near_points<D>& near, const point_matrix<double, D>& moved,
           const index_list& indices, pair_sums<D>& sums) const {
    if (!near.tree) return;
    point_matrix<double, D> queries(D, std::ssize(indices));
    for (index_t q = 0; q < queries.cols(); ++q) queries.col(q) = moved.col(indices[q]);
    const auto found = near.tree->find_all(queries, knn_in_radius{1, target_.distance()});
    for (index_t q = 0; q < queries.cols(); ++q) {
      if (found[q].size() == 0) continue;
      const auto nearest = found[q][0];
      const vector target = near.points.col(nearest.index);
      matched_pair<D> pair{queries.col(q), target, vector::Zero(),
                           vector::Zero(), 0,      nearest.index};
      if (is_plane_) pair.target_normal = near.normals.col(nearest.index);
      add_pair(pair, nearest.distance, sums);
    }
  }

 private:
  using vector = point_vector<double, D>;

  void add_pair(const matched_pair<D>& pair, double distance, pair_sums<D>& sums) const {
    const double square = (pair.point - pair.target).squaredNorm();
    sums.add_distance(square);
    const vector place = pair.point - center_;
    if (is_in_closed_form()) {
      sums.squared_residual += square;
      sums.add_place(1, 1, place);
      sums.add_match(place, pair.target - center_);
    } else if (is_plane_) {
      add_rows(plane_, pair, distance, sums);
    } else {
      add_rows(point_, pair, distance, sums);
    }
  }
  template <class Metric>
  void add_rows(const Metric& metric, const matched_pair<D>& pair, double distance,
                pair_sums<D>& sums) const {
    double seen_weight = 0, largest_gradient = -1;
    weighted_rows(metric, pair, distance,
                  [&](double weight, double value, const vector& gradient, const vector& at) {
                    std::array<double, pair_sums<D>::unknowns> row;
                    rigid_motion::pull_back(vector{at - center_}, gradient, row.data());
                    sums.add_row(weight, value, row);
                    seen_weight = weight;
                    largest_gradient = std::max(largest_gradient, gradient.squaredNorm());
                  });
    if (largest_gradient >= 0) sums.add_place(seen_weight, largest_gradient, pair.point - center_);
  }

  const survey_around<S, D>& target_;
  bool is_plane_, is_robust_;
  weighted_term<point_to_plane, unit_weight, robust_kernel> plane_;
  weighted_term<point_to_point, unit_weight, robust_kernel> point_;
  vector center_;
  std::stop_token stop_;
};

template <int D>
point_matrix<double, D> moved_by(const rigid_transform<double, D>& transform,
                                 const point_matrix<double, D>& places) {
  return (transform.linear() * places).colwise() + point_vector<double, D>{transform.translation()};
}

/// The pairs of a scan: a searcher whose pairs are added up already.
template <Scalar S, int D>
class scan_pairs {
 public:
  template <class>
  using pairs_type = pair_sums<D>;

  scan_pairs(const point_cloud<S, D>& scan, const pair_adder<S, D>& adder)
      : adder_{adder},
        places_{adder.target().places_of(scan)},
        sources_{scan.size() - count_non_finite(scan.points)} {}

  void find(const rigid_transform<double, D>& transform, pair_sums<D>& pairs) const {
    const auto moved = moved_by<D>(transform, places_);
    const auto squares = adder_.target().by_square(moved);
    std::erase_if(kept_, [&](const auto& entry) {
      const bool is_left = !squares.contains(entry.first);
      if (is_left) kept_bytes_ -= entry.second->bytes();
      return is_left;
    });
    // What is kept leaves room for the largest square.
    std::uint64_t largest = 0;
    on_all_ranks(adder_.target().ranks(), [&] {
      for (const auto& [square, indices] : squares)
        largest = std::max(largest, adder_.target().memory_around(square));
    });
    const auto to_keep = (adder_.target().memory() - largest) / 2;
    pairs =
        sum_over_squares(
            adder_.target(), squares, std::vector<pair_sums<D>>(1), {{}, adder_.stop()}, to_keep,
            [&](const tile_key& square, const index_list& indices,
                std::vector<pair_sums<D>>& sums) {
              adder_.add(*points_around(square, to_keep), moved, indices, sums.front());
            })
            .front();
    pairs.sources = sources_;
  }

 private:
  std::shared_ptr<const near_points<D>> points_around(const tile_key& square,
                                                      std::uint64_t to_keep) const {
    {
      const std::scoped_lock lock{mutex_};
      if (const auto known = kept_.find(square); known != kept_.end()) return known->second;
    }
    const auto near = std::make_shared<const near_points<D>>(adder_.load(square));
    const std::scoped_lock lock{mutex_};
    if (kept_bytes_ + near->bytes() <= to_keep && kept_.emplace(square, near).second)
      kept_bytes_ += near->bytes();
    return near;
  }

  const pair_adder<S, D>& adder_;
  point_matrix<double, D> places_;
  index_t sources_;
  // What earlier searches have read; no result depends on it.
  mutable std::mutex mutex_;
  mutable std::map<tile_key, std::shared_ptr<const near_points<D>>> kept_;
  mutable std::uint64_t kept_bytes_ = 0;
};

/// The same of a survey, by its tiles.
template <Scalar S, int D>
class survey_pairs {
 public:
  template <class>
  using pairs_type = pair_sums<D>;

  survey_pairs(const tiled_cloud<S, D>& source, const pair_adder<S, D>& adder)
      : source_{with_decided_steps(source, {{}, adder.stop()})}, adder_{adder} {}

  void find(const rigid_transform<double, D>& transform, pair_sums<D>& pairs) const {
    const auto& target = adder_.target();
    pairs = sum_over_tiles(
                source_, std::vector<pair_sums<D>>(1),
                [&](index_t t) { return target.memory_around(area_after(transform, t)); },
                {{}, adder_.stop()},
                [&](const point_cloud<S, D>& points, std::vector<pair_sums<D>>& sums) {
                  const auto moved = moved_by<D>(transform, target.places_of(points));
                  sums.front().sources += points.size() - count_non_finite(points.points);
                  for (const auto& [square, indices] : target.by_square(moved))
                    adder_.add(adder_.load(square), moved, indices, sums.front());
                })
                .front();
  }

 private:
  /// Where the points of a tile may be once they are moved; nothing if that is anywhere.
  [[nodiscard]] std::optional<tile_area> area_after(const rigid_transform<double, D>& transform,
                                                    index_t t) const {
    if (std::ranges::any_of(source_.steps(), &tile_step<S, D>::moves_points)) return std::nullopt;
    const auto origin = adder_.target().origin();
    const auto square = area_of(source_.tiles()[t], source_.edge());
    auto column = source_.survey()->bounds;
    for (int d = 0; d < 2; ++d) {
      column.lower[d] = square.lower[d];
      column.upper[d] = square.upper[d];
    }
    extent<D> moved;
    for (int corner = 0; corner < 1 << D; ++corner) {
      point_vector<double, D> place;
      for (int d = 0; d < D; ++d)
        place[d] = ((corner >> d) % 2 == 0 ? column.lower[d] : column.upper[d]) - origin[d];
      moved.add(point_vector<double, D>{transform * place + origin});
    }
    return tile_area{{moved.lower[0], moved.lower[1]}, {moved.upper[0], moved.upper[1]}};
  }

  tiled_cloud<S, D> source_;
  const pair_adder<S, D>& adder_;
};

/// Where the source is, about: sums around it lose nothing that matters.
template <Scalar S, int D>
point_vector<double, D> middle_of(const point_cloud<S, D>& scan,
                                  const point_vector<double, D>& origin) {
  extent<D> all;
  for (index_t i = 0; i < scan.size(); ++i)
    if (is_finite(scan.points.col(i))) all.add(scan.points.col(i).template cast<double>());
  if (all.empty()) return point_vector<double, D>::Zero();
  point_vector<double, D> middle = scan.full_origin() - origin;
  for (int d = 0; d < D; ++d) middle[d] += (all.lower[d] + all.upper[d]) / 2;
  return middle;
}
template <Scalar S, int D>
point_vector<double, D> middle_of(const tiled_cloud<S, D>& survey,
                                  const point_vector<double, D>& origin) {
  point_vector<double, D> middle = point_vector<double, D>::Zero();
  const auto& bounds = survey.survey()->bounds;
  if (bounds.empty()) return middle;
  for (int d = 0; d < D; ++d) middle[d] = (bounds.lower[d] + bounds.upper[d]) / 2 - origin[d];
  return middle;
}

template <Scalar S, int D>
index_t non_finite_of(const point_cloud<S, D>& scan) {
  return count_non_finite(scan.points);
}
template <Scalar S, int D>
index_t non_finite_of(const tiled_cloud<S, D>&) {
  return 0;
}
template <Scalar S, int D>
scan_pairs<S, D> pairs_between(const point_cloud<S, D>& scan, const pair_adder<S, D>& adder) {
  return {scan, adder};
}
template <Scalar S, int D>
survey_pairs<S, D> pairs_between(const tiled_cloud<S, D>& survey, const pair_adder<S, D>& adder) {
  return {survey, adder};
}

/// Those who share the work.
template <Scalar S, int D>
const process_group* ranks_of(const point_cloud<S, D>&, const tiled_cloud<S, D>& target) {
  return target.ranks().get();
}
template <Scalar S, int D>
const process_group* ranks_of(const tiled_cloud<S, D>& source, const tiled_cloud<S, D>&) {
  return source.ranks().get();
}

/// Whether the points have normals after all steps, as the smallest tile that has points tells.
template <Scalar S, int D>
bool has_normals(const tiled_cloud<S, D>& cloud, const std::stop_token& stop) {
  auto order = all_tiles(*cloud.survey());
  const auto& tiles = cloud.tiles();
  std::ranges::sort(order, {}, [&](index_t t) { return std::pair{tiles[t].points, t}; });
  for (const index_t t : order) {
    const auto points = run_tile<S, D>(*cloud.survey(), cloud.steps(), tiles[t], 0, stop);
    if (!points.empty()) return points.has_normals();
  }
  return false;
}

void expect_possible(const align_options& o) {
  expects(std::holds_alternative<point_to_plane>(o.metric) ||
              std::holds_alternative<point_to_point>(o.metric),
          "align: onto a survey, the metric must be point_to_plane or point_to_point");
  expects(o.scales.empty(),
          "align: onto a survey there are no .scales: call it once for each, on "
          "survey | voxel_downsample(…) that was written");
  expects(o.max_distance > 0 && std::isfinite(o.max_distance),
          "align, evaluate: a survey is searched around each tile, up to a .max_distance that must "
          "be positive and finite");
  expects(o.graduation == 1, "align: onto a survey there is no .graduation");
  expects(!o.reciprocal && o.one_to_one == sides::none && o.fraction == 1,
          "align: onto a survey, pairs are those of each source point, without .reciprocal, "
          ".one_to_one or .fraction");
  expects(o.threads == 0, "align: .threads of a survey are those of open_tiles");
}

template <int D>
rigid_transform<double, D> start_of(const align_options& options) {
  using transform_type = rigid_transform<double, D>;
  if (!options.initial) return transform_type::Identity();
  const auto start = options.initial->as<transform_type>(
      D, "align: initial transform and points must have the same dimension");
  expects(is_finite(start.linear().reshaped()) && is_finite(start.translation()),
          "align, evaluate: the transform must be finite");
  expects((start.linear() * start.linear().transpose()).isIdentity(1e-3) &&
              determinant(start.linear()) > 0,
          "align, evaluate: the transform must be rigid, but its linear part is not a rotation");
  return start;
}

template <Scalar S, int D, class Source>
icp_result<rigid_transform<double, D>> align_any(const Source& source,
                                                 const tiled_cloud<S, D>& target,
                                                 const align_options& options) {
  using transform_type = rigid_transform<double, D>;
  expect_possible(options);
  const transform_type start = start_of<D>(options);
  try {
    // What the ranks do each by itself may fail, and what is the caller's may throw, or ask for a
    // stop, on one of them: no other must wait for it.
    const process_group* const ranks = ranks_of(source, target);
    std::optional<survey_around<S, D>> near;
    on_all_ranks(ranks, [&] {
      const task_monitor stop_only{{}, options.monitor.stop};
      auto onto = with_decided_steps(target, stop_only);
      if (std::holds_alternative<point_to_plane>(options.metric) &&
          !has_normals(onto, stop_only.stop))
        onto = onto | estimate_normals(options.normals);
      double edge = target.edge();
      if constexpr (std::same_as<Source, tiled_cloud<S, D>>) edge = source.edge();
      near.emplace(onto, edge, options.max_distance, "align", stop_only);
    });
    const point_vector<double, D> center = start * middle_of(source, near->origin());
    const pair_adder<S, D> adder{*near, options, center};
    const auto searcher = pairs_between(source, adder);
    const rigid_equations<D> equations{adder.is_in_closed_form(), options.solver, center,
                                       non_finite_of(source)};
    icp_options<transform_type> how{.max_iterations = options.max_iterations,
                                    .tolerance = options.tolerance};
    how.observer = [&](const icp_iteration<transform_type>& now) {
      on_all_ranks(ranks, [&] {
        if (options.monitor.stop.stop_requested()) throw cancelled{};
        const any_transform reached = now.transform;
        if (options.observer) options.observer({now.number, reached, now.change, now.fit});
        if (options.monitor.progress && now.number < options.max_iterations)
          options.monitor.progress(double(now.number) / double(options.max_iterations));
      });
    };
    on_all_ranks(ranks, [&] {
      if (options.monitor.stop.stop_requested()) throw cancelled{};
    });
    auto result = icp(searcher, equations, start, how);
    if (options.monitor.progress && result.status != icp_status::cancelled)
      options.monitor.progress(1);
    return result;
  } catch (const cancelled&) {
    icp_result<transform_type> result;
    result.transform = start;
    result.status = icp_status::cancelled;
    return result;
  }
}

}  // namespace

template <Scalar S, int D>
icp_result<rigid_transform<double, D>> align(const point_cloud<S, D>& source,
                                             const tiled_cloud<S, D>& target,
                                             const align_options& options) {
  return align_any(source, target, options);
}
template <Scalar S, int D>
icp_result<rigid_transform<double, D>> align(const tiled_cloud<S, D>& source,
                                             const tiled_cloud<S, D>& target,
                                             const align_options& options) {
  return align_any(source, target, options);
}

#define CILANTRO_INSTANTIATE(S, D)                                               \
  template icp_result<rigid_transform<double, D>> align(                         \
      const point_cloud<S, D>&, const tiled_cloud<S, D>&, const align_options&); \
  template icp_result<rigid_transform<double, D>> align(                         \
      const tiled_cloud<S, D>&, const tiled_cloud<S, D>&, const align_options&);
CILANTRO_INSTANTIATE(float, 2)
CILANTRO_INSTANTIATE(float, 3)
CILANTRO_INSTANTIATE(double, 2)
CILANTRO_INSTANTIATE(double, 3)
#undef CILANTRO_INSTANTIATE

}  // namespace cilantro
