// SPDX-License-Identifier: MIT
module;
#include "core/closed_spaces.hpp"
module cilantro.warp;

namespace cilantro {
namespace {

/// At most one point takes part of each cell whose edge is this share of the spacing: nodes cannot
/// bend to more. In the last level, and before.
constexpr double last_cell = 1.0 / 8, early_cell = 1.0 / 4;
/// The kernel shrinks by this from one level to the next: what it lets in must still be near what
/// it let in before.
constexpr double shrinking = 1.6;
/// As long as the kernel is larger than in the end by this, half as many nodes along each axis do.
constexpr double coarse_from = 6;

/// A pair of a landmark has this distance, which no pair of a search has.
constexpr int landmark_distance = -1;
struct weight_of_found {
  template <Scalar S>
  S operator()(S distance) const {
    return distance == S(landmark_distance) ? S(0) : S(1);
  }
};
struct weight_of_landmarks {
  template <Scalar S>
  S operator()(S distance) const {
    return distance == S(landmark_distance) ? S(1) : S(0);
  }
};

/// How far the pairs may be apart and what bends, from coarse to fine.
struct non_rigid_level {
  double kernel_scale, stiffness, max_distance, tolerance;
  bool is_coarse, is_last;
};

std::vector<non_rigid_level> levels_of(const non_rigid_options& options, double farthest) {
  const double last = options.kernel_scale > 0 ? options.kernel_scale : options.spacing / 8;
  const double first = std::max(farthest / 3, last);
  constexpr double most_steps = 60;
  const auto steps = static_cast<int>(
      std::min(std::ceil(std::log(first / last) / std::log(shrinking)), most_steps));
  const double tolerance = options.tolerance > 0 ? options.tolerance : options.spacing / 20;
  std::vector<non_rigid_level> levels;
  for (int k = steps; k >= 0; --k) {
    const double ratio = steps > 0 ? std::pow(first / last, double(k) / double(steps)) : 1;
    const double scale = last * ratio;
    levels.push_back({scale, std::min(options.stiffness * ratio * ratio, most_stiffness),
                      std::min(farthest, 3 * scale),
                      k > 0 ? std::max(tolerance, scale / 10) : tolerance, ratio > coarse_from,
                      k == 0});
  }
  return levels;
}

void expect_valid(const non_rigid_options& o, bool is_rigid) {
  constexpr double most = std::numeric_limits<double>::max();
  expects(o.spacing > 0 && o.spacing <= most,
          "align_non_rigid: .spacing, the distance between nodes, must be positive and finite");
  expects(o.max_distance > 0, "align_non_rigid: .max_distance must be positive");
  expect_between(0, o.kernel_scale, most, "align_non_rigid: kernel_scale");
  expect_between(0, o.point_weight, most, "align_non_rigid: point_weight");
  expect_between(0, o.tolerance, most, "align_non_rigid: tolerance");
  expect_between(0, o.landmark_weight, most, "align_non_rigid: landmark_weight");
  expect_from(0, o.max_iterations, "align_non_rigid: max_iterations");
  expect_from(0, o.final_iterations, "align_non_rigid: final_iterations");
  expects(!is_rigid || o.rigidity.value_or(0) == 0,
          "align_non_rigid: rigid motions need no .rigidity, which is for those that may deform");
  expect_valid(warp_options{.stiffness = o.stiffness, .rigidity = o.rigidity.value_or(0)},
               is_rigid);
}

/// A part of the source that represents all of it, and where the landmarks are among its points.
template <Scalar S, int D>
struct moving_points {
  point_matrix<S, D> points;
  correspondences<S> landmarks;
};

template <Scalar S, int D>
moving_points<S, D> moving_part(points_view<S, D> source, const non_rigid_options& options,
                                double edge) {
  moving_points<S, D> part;
  index_list kept;
  if (edge > 0) {
    const voxel_grid<S, D> grid{source, voxel_size{edge}, {.threads = options.threads}};
    kept = first_of_groups(grid.groups());
  } else {
    kept.resize(static_cast<std::size_t>(source.size()));
    std::iota(kept.begin(), kept.end(), 0);
  }
  for (const auto& [s, t] : options.landmarks) {
    const auto place = edge > 0 ? std::ssize(kept) : s;
    if (edge > 0) kept.push_back(static_cast<std::int32_t>(s));
    part.landmarks.push_back(
        {static_cast<std::int32_t>(place), static_cast<std::int32_t>(t), S(landmark_distance)});
  }
  part.points.resize(source.dimension(), std::ssize(kept));
  for (index_t i = 0; i < part.points.cols(); ++i) part.points.col(i) = source[kept[i]];
  return part;
}

/// The nearest points within a limit that may be smaller than that of the searcher, and the
/// landmarks.
template <Scalar S, int D>
struct non_rigid_searcher {
  using memory = nearest_neighbor_memory<S>;

  const detail::nearest_neighbor_engine<S, D>* nearest;
  points_view<S, D> source;
  const correspondences<S>* landmarks;
  S limit;

  template <class T>
  void find(const T& field, correspondences<S>& pairs) const {
    memory fresh;
    find(field, fresh, pairs);
  }
  template <class T>
  void find(const T& field, memory& known, correspondences<S>& pairs) const {
    const auto moved = moved_points(field, source, {.threads = nearest->threads()});
    nearest->find(as_points(moved), known, pairs);
    std::erase_if(pairs, [&](const auto& pair) { return pair.distance > limit; });
    if (landmarks->empty()) return;
    pairs.insert(pairs.end(), landmarks->begin(), landmarks->end());
    std::ranges::sort(pairs, {}, [](const auto& pair) {
      return std::tuple{pair.source, pair.target, pair.distance};
    });
  }
};

/// Everything that a few levels with the same points and nodes share.
template <Scalar S, int D>
struct non_rigid_stage {
  moving_points<S, D> moving;
  deformation_graph<S, D> graph;
  std::optional<detail::nearest_neighbor_engine<S, D>> nearest;
  nearest_neighbor_memory<S> nearest_memory;
  warp_memory estimator_memory;
};

template <MotionModel Motion, Scalar S, int D>
class non_rigid_loop {
 public:
  non_rigid_loop(const oriented_points_view<S, D>& source, const oriented_points_view<S, D>& target,
                 const non_rigid_options& options)
      : source_{source}, target_{target}, options_{options}, extent_{extent()} {}

  closed_non_rigid_result<S, D> run() {
    const double farthest = std::min(
        std::isfinite(options_.max_distance) ? options_.max_distance : farthest_pair(), extent_);
    const auto levels = levels_of(options_, farthest);
    for (std::size_t k = 0; k < levels.size(); ++k) {
      task_monitor monitor{{}, options_.monitor.stop};
      if (options_.monitor.progress)
        monitor.progress = [&, k](double done) {
          options_.monitor.progress((double(k) + done) / double(levels.size()));
        };
      try {
        if (monitor.stop.stop_requested()) throw cancelled{};
        run(levels[k], farthest, monitor);
      } catch (const cancelled&) {
        result_.status = icp_status::cancelled;
      }
      if (result_.status == icp_status::cancelled || result_.status == icp_status::too_few_pairs)
        break;
    }
    finish();
    return std::move(result_);
  }

 private:
  using field_type = warp_field<S, D, Motion>;
  using metric_type = combined_metric<weighted_term<point_to_point, weight_of_found, welsch>,
                                      weighted_term<point_to_plane, weight_of_found, welsch>,
                                      weighted_term<point_to_point, weight_of_landmarks>>;
  using estimator_type = warp_estimator<S, D, metric_type, Motion>;

  /// The estimator of a stage, which leaves what it finds in the memory of the stage.
  struct stage_estimator {
    using transform_type = field_type;
    const estimator_type& estimator;
    warp_memory& known;

    [[nodiscard]] registration_step<field_type> estimate(
        const field_type& current, std::span<const correspondence<S>> pairs) const {
      return estimator.estimate(current, pairs, known);
    }
  };

  double farthest_pair() {
    const nearest_neighbor_searcher<S, D> searcher{source_, target_, {.threads = options_.threads}};
    correspondences<S> pairs;
    searcher.find(identity_transform<affine_transform<S, D>>(source_.points.dimension()), pairs);
    double farthest = 0;
    for (const auto& pair : pairs) farthest = std::max(farthest, double(pair.distance));
    return farthest > 0 ? farthest : options_.spacing;
  }

  /// The diagonal of the box around both sets: no two points are farther apart.
  [[nodiscard]] double extent() const {
    constexpr double infinity = std::numeric_limits<double>::infinity();
    const index_t d = std::max(source_.points.dimension(), target_.points.dimension());
    Eigen::VectorXd low = Eigen::VectorXd::Constant(d, infinity), high = -low;
    for (const auto& set : {source_.points, target_.points})
      for (const auto& p : set)
        if (is_finite(p)) {
          low = low.cwiseMin(p.template cast<double>());
          high = high.cwiseMax(p.template cast<double>());
        }
    const double size = (high - low).norm();
    return size > 0 && std::isfinite(size) ? size : options_.spacing;
  }

  /// Coarse levels have fewer points and nodes; the last one has all nodes.
  void enter_stage(const non_rigid_level& level, double farthest) {
    const double spacing = options_.spacing * (level.is_coarse ? 2 : 1);
    // However wide the spacing, the shape of the source must remain.
    const double cell = std::min(spacing * (level.is_last ? last_cell : early_cell),
                                 extent_ * (level.is_last ? 1.0 / 128 : 1.0 / 64));
    auto moving = moving_part<S, D>(source_.points, options_, cell);
    // Where little can be left out, all take part from the beginning.
    if (3 * moving.points.cols() > 2 * source_.points.size())
      moving = moving_part<S, D>(source_.points, options_, 0);
    estimator_.reset();
    const auto last = std::exchange(stage_, std::make_unique<non_rigid_stage<S, D>>());
    stage_->moving = std::move(moving);
    stage_->graph = level.is_last
                        ? graph_of_last_level()
                        : deformation_graph<S, D>{stage_->moving.points, nodes_by(spacing)};
    stage_->nearest.emplace(
        as_points(stage_->moving.points), target_.points,
        correspondence_options{.max_distance = farthest, .threads = options_.threads},
        task_monitor{{}, options_.monitor.stop}, last ? &*last->nearest : nullptr);
    field_ = resample(field_, stage_->graph);
  }

  [[nodiscard]] deformation_graph_options nodes_by(double spacing) const {
    return {.spacing = spacing,
            .anchors = options_.anchors,
            .links = options_.links,
            .threads = options_.threads};
  }
  /// The nodes are those of all points, whichever take part.
  deformation_graph<S, D> graph_of_last_level() {
    if (stage_->moving.points.cols() == source_.points.size()) return whole_graph();
    return {stage_->moving.points, nodes_at<S, D>{whole_graph().nodes()}, nodes_by(0)};
  }
  const deformation_graph<S, D>& whole_graph() {
    if (!whole_graph_) whole_graph_.emplace(source_.points, nodes_by(options_.spacing));
    return *whole_graph_;
  }

  void run(const non_rigid_level& level, double farthest, const task_monitor& monitor) {
    if (!stage_ || level.is_coarse != is_coarse_ ||
        (level.is_last && stage_->moving.points.cols() < source_.points.size()))
      enter_stage(level, farthest);
    is_coarse_ = level.is_coarse;
    is_last_ = level.is_last;
    const auto& moving = stage_->moving;
    const welsch kernel{level.kernel_scale};
    const double landmark_weight = moving.landmarks.empty()
                                       ? 0
                                       : options_.landmark_weight * double(moving.points.cols()) /
                                             double(moving.landmarks.size());
    const metric_type metric{
        weighted_term{point_to_point{}, options_.point_weight, weight_of_found{}, kernel},
        weighted_term{point_to_plane{}, 1, weight_of_found{}, kernel},
        weighted_term{point_to_point{}, landmark_weight, weight_of_landmarks{}}};
    constexpr bool may_deform = !RigidMap<transform_of<Motion, double, D>>;
    const warp_options bending{.stiffness = level.stiffness,
                               .smoothness = options_.smoothness,
                               .rigidity = may_deform ? options_.rigidity.value_or(0.01) : 0,
                               .threads = options_.threads};
    if (!estimator_) {
      const oriented_points_view<S, D> source{as_points(moving.points), points_view<S, D>{}};
      estimator_.emplace(source, target_, stage_->graph, metric, bending);
    } else {
      estimator_ = estimator_->with(metric, bending);
    }
    const non_rigid_searcher<S, D> searcher{&*stage_->nearest, as_points(moving.points),
                                            &moving.landmarks, static_cast<S>(level.max_distance)};
    if (!level.is_last) return approach(level, searcher, monitor);

    icp_options<field_type> how{.max_iterations = options_.final_iterations,
                                .tolerance = level.tolerance,
                                .rotation_tolerance = std::numeric_limits<double>::infinity(),
                                .monitor = monitor};
    if (options_.observer)
      how.observer = [&](const icp_iteration<field_type>& now) {
        observe(level, iterations_ + now.number, now.change, now.fit);
      };
    auto found = icp(searcher, stage_estimator{*estimator_, stage_->estimator_memory}, field_, how);
    // Stopped before it looked at anything: then the figures are those of the level before.
    if (found.status == icp_status::cancelled && found.pairs == 0) throw cancelled{};
    field_ = std::move(found.transform);
    static_cast<alignment_fit&>(result_) = std::move(static_cast<alignment_fit&>(found));
    result_.status = found.status;
    iterations_ += found.iterations;
    result_.last_change = found.last_change;
    auto& energy = stage_->estimator_memory.energy;
    result_.energy = energy.total();
    result_.unsupported_nodes = std::move(energy.unsupported_nodes);
  }

  /// The iterations of a level whose end nobody looks at.
  void approach(const non_rigid_level& level, const non_rigid_searcher<S, D>& searcher,
                const task_monitor& monitor) {
    correspondences<S> pairs;
    for (int i = 0; i < options_.max_iterations; ++i) {
      if (monitor.stop.stop_requested()) throw cancelled{};
      searcher.find(field_, stage_->nearest_memory, pairs);
      auto step = estimator_->estimate(field_, pairs, stage_->estimator_memory);
      field_ = std::move(step.transform);
      static_cast<alignment_fit&>(result_) = std::move(step.fit);
      result_.last_change = step.change;
      observe(level, ++iterations_, step.change, result_);
      if (monitor.progress) monitor.progress(double(i + 1) / double(options_.max_iterations));
      if (step.change.translation <= level.tolerance) break;
    }
  }
  void observe(const non_rigid_level& level, int number, const transform_change& change,
               const alignment_fit& fit) const {
    if (options_.observer)
      options_.observer({number, level.kernel_scale, level.stiffness,
                         index_t(stage_->moving.points.cols()), stage_->graph.nodes().size(),
                         change, fit});
  }

  /// The field that was reached, as one of all source points.
  void finish() {
    // The last level has these nodes already; after a stop, there may be those of an earlier one.
    auto whole = is_last_ ? field_type{whole_graph()} : resample(field_, whole_graph());
    if (is_last_) whole.motions() = std::move(field_.motions());
    field_ = std::move(whole);
    result_.non_finite = count_non_finite(source_.points) + count_non_finite(target_.points);
    result_.iterations = iterations_;
    result_.graph = field_.graph().shared_data();
    result_.motions = std::move(field_.motions());
  }

  oriented_points_view<S, D> source_, target_;
  const non_rigid_options& options_;
  double extent_;
  std::unique_ptr<non_rigid_stage<S, D>> stage_;
  std::optional<estimator_type> estimator_;
  std::optional<deformation_graph<S, D>> whole_graph_;
  bool is_coarse_ = false, is_last_ = false;
  int iterations_ = 0;
  field_type field_;
  closed_non_rigid_result<S, D> result_;
};

template <MotionModel Motion, Scalar S, int D>
closed_non_rigid_result<S, D> align_by_levels(const oriented_points_view<S, D>& source,
                                              const oriented_points_view<S, D>& target,
                                              const non_rigid_options& options) {
  expect_valid(options, RigidMap<transform_of<Motion, double, D>>);
  expects(source.points.empty() || target.points.empty() ||
              source.points.dimension() == target.points.dimension(),
          "align_non_rigid: source and target must have the same dimension");
  for (const auto& [s, t] : options.landmarks)
    expects(
        0 <= s && s < source.points.size() && 0 <= t && t < target.points.size(),
        "align_non_rigid: a landmark is not among the points: its first number is of the source, "
        "its second of the target");
  for (const auto& [s, t] : options.landmarks)
    expects(is_finite(source.points[s]) && is_finite(target.points[t]),
            "align_non_rigid: a landmark is not finite");
  point_matrix<S, D> normals;
  oriented_points_view<S, D> onto = target;
  if (!target.has_normals() && !target.points.empty()) {
    normals =
        estimate_normals(target.points, options.normals, {.threads = options.threads}).normals;
    onto.normals = as_points(normals);
  }
  return non_rigid_loop<Motion, S, D>{source, onto, options}.run();
}

}  // namespace

template <MotionModel Motion, Scalar S, int D>
closed_non_rigid_result<S, D> align_non_rigid_closed(const oriented_points_view<S, D>& source,
                                                     const oriented_points_view<S, D>& target,
                                                     const non_rigid_options& options) {
  return align_by_levels<Motion, S, D>(source, target, options);
}

#define CILANTRO_INSTANTIATE(S, D)                                              \
  template closed_non_rigid_result<S, D> align_non_rigid_closed<rigid_motion>(  \
      const oriented_points_view<S, D>&, const oriented_points_view<S, D>&,     \
      const non_rigid_options&);                                                \
  template closed_non_rigid_result<S, D> align_non_rigid_closed<affine_motion>( \
      const oriented_points_view<S, D>&, const oriented_points_view<S, D>&,     \
      const non_rigid_options&);
CILANTRO_FOR_CLOSED_SPACES(CILANTRO_INSTANTIATE)
#undef CILANTRO_INSTANTIATE

}  // namespace cilantro
