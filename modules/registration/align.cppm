// SPDX-License-Identifier: MIT
module;
#include "core/closed_spaces.hpp"
export module cilantro.registration:align;

import cilantro.standard;
import cilantro.core;
import cilantro.search;
import cilantro.geometry;
import cilantro.cloud;
import :colored;
import :concepts;
import :correspondence;
import :icp;
import :least_squares;
import :motion;
import :nearest_neighbor;
import :normal_equations;
import :point_to_point;
import :residual;

namespace cilantro {

/// One pass of a registration from coarse to fine.
export struct align_scale {
  /// Both sets are reduced to one point per cell with this edge, at most `max_distance`; 0: not
  /// reduced.
  double voxel;
  double max_distance;  ///< The largest distance between the points of a pair.
};

/// The metrics that can be chosen in `align_options`. Any other is passed to `align` as an argument
/// of its own.
export using metric_choice =
    std::variant<point_to_plane, point_to_point, symmetric, generalized_icp,
                 combined_metric<weighted_term<point_to_point>, weighted_term<point_to_plane>>,
                 colored>;

/// One iteration of `align`, as it is passed to an observer; its transform is in double.
export using align_iteration = icp_iteration<any_transform>;

/// Options of `align`.
export struct align_options {
  metric_choice metric = point_to_plane{};  ///< What is minimised.
  /// The transform to start from, of any scalar; by default, the identity.
  std::optional<any_transform> initial = {};
  /// Points farther apart than this are never paired. Without a limit, parts that only one of the
  /// sets contains distort the result.
  double max_distance = std::numeric_limits<double>::infinity();
  int max_iterations = 30;  ///< In each scale.
  double tolerance = 1e-5;  ///< In radians, and in the units of the points; see `icp_options`.
  /// Passes from coarse to fine, each starting from the result of the one before. If given,
  /// `max_distance` must not be.
  std::vector<align_scale> scales = {};
  /// Neighbourhoods for estimating normals, where the metric needs them and the input has none.
  neighborhood_spec normals = knn{10};
  robust_kernel robust = {};  ///< A robust weight of the residuals, such as `huber{0.01}`.
  /// In each scale, the kernel starts this many times as wide as `robust`, at least 1, and narrows
  /// by 1.4 in each iteration until it is as given: wrong pairs then lose their influence one after
  /// the other, instead of the right ones at once where the start is far off (graduated
  /// non-convexity: Zhou, Park & Koltun 2016, "Fast global registration", section 3.1; Yang et al.
  /// 2020, "Graduated non-convexity for robust spatial perception"). 100 takes 14 iterations.
  double graduation = 1;
  /// Whether only pairs are kept in which each point is the other's nearest.
  bool reciprocal = false;
  sides one_to_one = sides::none;  ///< Sides on which each point is kept in its closest pair only.
  double fraction = 1;             ///< The share of the closest pairs that is kept, in (0, 1].
  truncated_solver solver = {};    ///< Decides which directions count as determined.
  std::function<void(const align_iteration&)> observer = {};  ///< Called after each iteration.
  int threads = 0;
  /// If a stop is requested, `align` returns with the status `cancelled` instead of throwing.
  task_monitor monitor = {};
};

/// Points, with normals if they are known, and the values that `colored` compares: the given ones,
/// or copies where they have been reduced or estimated.
template <Scalar S, int D>
struct prepared_points {
  oriented_points_view<S, D> given;
  point_matrix<S, D> points, normals;
  rounded_values values;

  [[nodiscard]] oriented_points_view<S, D> view() const {
    return oriented_points_view<S, D>{points.cols() > 0 ? as_points(points) : given.points,
                                      normals.cols() > 0 ? as_points(normals) : given.normals};
  }
};

/// What is registered: a surface, where its voxels are anchored, and the values that `colored`
/// compares, if it is the metric.
template <Scalar S, int D>
struct align_input {
  oriented_points_view<S, D> surface;
  std::optional<coordinates> anchor = {};
  rounded_values values = {};
};

/// Reduces a surface with its values to voxels, and estimates normals if they are needed and
/// missing.
template <Scalar S, int D>
[[nodiscard]] prepared_points<S, D> prepare(const align_input<S, D>& input, double voxel,
                                            bool needs_normals, const neighborhood_spec& spec,
                                            const execution& how);

/// Where a registration starts, and its observer.
template <class T>
struct align_start {
  T transform;
  std::function<void(const icp_iteration<T>&)> observer = {};
  /// How many times as wide the robust kernel is now; set in each iteration. Null: always once.
  std::shared_ptr<double> widening = {};
};

/// A kernel that is `widening` times as wide.
struct widened_kernel {
  robust_kernel kernel;
  std::shared_ptr<const double> widening;

  double operator()(double residual) const { return kernel(residual / *widening); }
};
/// Throws `invalid_input` unless there is a kernel to graduate, and enough iterations for it.
void expect_valid_graduation(const align_options& options);

/// An estimator behind a function, so that the loop is compiled once for all metrics.
template <class T>
struct erased_estimator {
  using transform_type = T;
  using scalar = typename T::Scalar;

  std::function<registration_step<T>(const T&, std::span<const correspondence<scalar>>)> function;

  [[nodiscard]] registration_step<T> estimate(const T& current,
                                              std::span<const correspondence<scalar>> pairs) const {
    return function(current, pairs);
  }
};

/// Makes an estimator for one scale.
template <Scalar S, int D, class T>
using estimator_maker = std::function<erased_estimator<T>(const prepared_points<S, D>& source,
                                                          const prepared_points<S, D>& target)>;

/// All scales, one after the other.
template <Scalar S, int D, class T>
[[nodiscard]] icp_result<T> align_scales(const align_input<S, D>& source,
                                         const align_input<S, D>& target,
                                         const align_start<T>& start, const align_options& options,
                                         bool needs_source_normals, bool needs_target_normals,
                                         const estimator_maker<S, D, T>& make_estimator);

/// The estimator that `align` uses for a metric.
template <MotionModel Model, Scalar S, int D, class Metric>
[[nodiscard]] auto make_estimator(const oriented_points_view<S, D>& source,
                                  const oriented_points_view<S, D>& target, const Metric& metric,
                                  const truncated_solver& solver, const execution& how) {
  using T = transform_of<Model, S, D>;
  const auto erase = [](auto estimator) {
    return erased_estimator<T>{[estimator = std::move(estimator)](
                                   const T& current, std::span<const correspondence<S>> pairs) {
      return estimator.estimate(current, pairs);
    }};
  };
  if constexpr (std::same_as<Metric, point_to_point> &&
                (std::same_as<Model, rigid_motion> || std::same_as<Model, affine_motion>))
    return erase(
        point_to_point_estimator<S, D, Model>{source, target, Model{}, unit_weight{}, solver, how});
  else
    return erase(
        least_squares_estimator<S, D, Metric, Model>{source, target, metric, Model{}, solver, how});
}

/// With any metric; see `align` below.
template <MotionModel Model, Scalar S, int D, class Metric>
[[nodiscard]] auto align_with(const align_input<S, D>& source, const align_input<S, D>& target,
                              const Metric& metric,
                              const align_start<transform_of<Model, S, D>>& start,
                              const align_options& o) {
  using T = transform_of<Model, S, D>;
  return align_scales<S, D, T>(
      source, target, start, o, needs_source_normals<Metric>, needs_target_normals<Metric>,
      [&](const prepared_points<S, D>& moving, const prepared_points<S, D>& onto) {
        return make_estimator<Model>(moving.view(), onto.view(), metric, o.solver,
                                     {.threads = o.threads});
      });
}

/// By planes and colours: the gradients are those of each scale. Compiled in the library for
/// `rigid_motion` and `affine_motion`.
template <MotionModel Model, Scalar S, int D>
[[nodiscard]] auto align_colored(const align_input<S, D>& source, const align_input<S, D>& target,
                                 const colored& metric,
                                 const align_start<transform_of<Model, S, D>>& start,
                                 const align_options& o) -> icp_result<transform_of<Model, S, D>> {
  return align_scales<S, D, transform_of<Model, S, D>>(
      source, target, start, o, false, true,
      [&](const prepared_points<S, D>& moving, const prepared_points<S, D>& onto) {
        const auto gradients = value_gradients(onto.view(), onto.values, metric.gradients,
                                               {o.threads, task_monitor{{}, o.monitor.stop}});
        // One kernel for all, which may be none, is compiled in half the time of two metrics.
        return make_estimator<Model>(
            moving.view(), onto.view(),
            weighted_term{colored_point_to_plane<D>{moving.values.values, onto.values.values,
                                                    gradients, metric.share},
                          1, unit_weight{}, o.robust},
            o.solver, {.threads = o.threads});
      });
}

template <class Term>
[[nodiscard]] auto with_kernel(const Term& term, const robust_kernel& robust) {
  return weighted_term<Term, unit_weight, robust_kernel>{term, 1, {}, robust};
}
template <class Term>
[[nodiscard]] auto with_kernel(const weighted_term<Term>& part, const robust_kernel& robust) {
  return weighted_term<Term, unit_weight, robust_kernel>{part.term, part.weight, {}, robust};
}
template <class A, class B>
[[nodiscard]] auto with_kernel(const combined_metric<A, B>& sum, const robust_kernel& robust) {
  return combined_metric{with_kernel(sum.template term<0>(), robust),
                         with_kernel(sum.template term<1>(), robust)};
}

/// With the metric and the kernel of the options. Compiled in the library for `rigid_motion` and
/// `affine_motion`.
template <MotionModel Model, Scalar S, int D>
[[nodiscard]] auto align_by_options(const align_input<S, D>& source,
                                    const align_input<S, D>& target,
                                    const align_start<transform_of<Model, S, D>>& start,
                                    const align_options& o)
    -> icp_result<transform_of<Model, S, D>> {
  if (o.graduation != 1 && !start.widening) {
    expect_valid_graduation(o);
    auto widening_start = start;
    widening_start.widening = std::make_shared<double>(o.graduation);
    auto widened = o;
    widened.robust = widened_kernel{o.robust, widening_start.widening};
    return align_by_options<Model>(source, target, widening_start, widened);
  }
  return std::visit(
      [&]<class Metric>(const Metric& metric) {
        if constexpr (std::same_as<Metric, colored>)
          return align_colored<Model>(source, target, metric, start, o);
        else if (!o.robust)
          return align_with<Model>(source, target, metric, start, o);
        else
          return align_with<Model>(source, target, with_kernel(metric, o.robust), start, o);
      },
      o.metric);
}

/// The values that `colored` compares. Throws `invalid_input` if the points, which are the `source`
/// or the `target`, do not have them.
template <PointsSource P>
[[nodiscard]] rounded_values values_in(const P& points, const colored& metric, const char* whose) {
  if (points_in(points).empty()) return {};
  if (metric.attribute.empty()) {
    const auto colors = colors_in(points);
    expects(!colors.empty(), std::string{"align: the metric `colored` needs colors, and the "} +
                                 whose + " has none");
    return rounded_values::of(intensities(colors));
  }
  const attribute* found = nullptr;
  if constexpr (PointCloud<P>) found = points.find_attribute(metric.attribute);
  expects(found != nullptr, "align: the metric `colored` needs the attribute \"" +
                                metric.attribute + "\", and the " + whose + " has none");
  expects(found->size() == points_in(points).size(), "align: the attribute \"" + metric.attribute +
                                                         "\" of the " + whose +
                                                         " must have one value per point");
  return rounded_values_of(*found);
}

/// A surface and where it lies, in the dimension that the library is compiled for.
template <int C, PointsSource P>
[[nodiscard]] auto align_input_of(const P& points, const metric_choice& metric, const char* whose) {
  using S = scalar_of<P>;
  align_input<S, C> input{oriented<S, C>(points)};
  if (const auto origin = origin_in(points); !origin.isZero(0))
    input.anchor = coordinates{(-origin).eval()};
  if (const auto* by_color = std::get_if<colored>(&metric))
    input.values = values_in(points, *by_color, whose);
  return input;
}

/// What is added to source coordinates to make them relative to the target's origin.
template <PointsSource A, PointsSource B>
[[nodiscard]] Eigen::VectorXd shift_between(const A& source, const B& target) {
  const Eigen::VectorXd from = origin_in(source), to = origin_in(target);
  if (from.size() != to.size()) return Eigen::VectorXd::Zero(std::max(from.size(), to.size()));
  return from - to;
}

/// First the shift, then `t`, as a transform of type T.
template <class T, AffineMap From>
[[nodiscard]] T after_shift(const From& t, const Eigen::VectorXd& shift) {
  using S = typename T::Scalar;
  return make_transform<T>(t.linear(), (t.translation() + t.linear() * shift.cast<S>()).eval());
}

/// Converts between the types of the caller and those that the library is compiled for.
template <MotionModel Model, PointsSource A, PointsSource B, class F>
[[nodiscard]] auto align_any(const A& source, const B& target, const align_options& o,
                             F&& align_in_closed_dimension) {
  using S = scalar_of<A>;
  constexpr int D = dimension_of<A>, C = closed_dimension<D>;
  using T = transform_of<Model, S, D>;
  using closed_type = transform_of<Model, S, C>;
  const auto moving = align_input_of<C>(source, o.metric, "source");
  const auto onto = align_input_of<C>(target, o.metric, "target");
  const index_t dimension =
      std::max<index_t>(moving.surface.points.dimension(), onto.surface.points.dimension());
  expects(moving.surface.points.empty() || onto.surface.points.empty() ||
              moving.surface.points.dimension() == onto.surface.points.dimension(),
          "align: source and target must have the same dimension");
  const Eigen::VectorXd shift = shift_between(source, target);
  const T initial =
      o.initial ? o.initial->as<T>(
                      dimension, "align: initial transform and points must have the same dimension")
                : identity_transform<T>(dimension);
  expects(is_finite(initial.linear().reshaped()) && is_finite(initial.translation()),
          "align, evaluate: the transform must be finite");
  if constexpr (std::same_as<Model, rigid_motion>)
    expects((initial.linear() * initial.linear().transpose()).isIdentity(S(1e-3)) &&
                determinant(initial.linear().template cast<double>()) > 0,
            "align, evaluate: the transform must be rigid, but its linear part is not a rotation");

  align_start<closed_type> start{after_shift<closed_type>(initial, shift)};
  if (o.observer)
    start.observer = [&](const icp_iteration<closed_type>& now) {
      const any_transform reached = after_shift<T>(now.transform, -shift);
      o.observer({now.number, reached, now.change, now.fit});
    };
  auto found = align_in_closed_dimension(moving, onto, start);
  icp_result<T> result;
  static_cast<alignment_fit&>(result) = std::move(static_cast<alignment_fit&>(found));
  result.transform = after_shift<T>(found.transform, -shift);
  result.status = found.status;
  result.iterations = found.iterations;
  result.last_change = found.last_change;
  return result;
}

/// Finds the transform that moves a source onto a target. Each is a cloud, points of any kind, or
/// points with normals as an `oriented_points_view`. Estimates the normals that the metric needs
/// and the input lacks, builds the trees, and runs `icp`. A few lines with the public parts of this
/// module give the same result, to the bit.
///
/// `align<affine_motion>(…)` finds an affine transform, and `align<my_motion>(…)` one of a motion
/// model of yours. If clouds have origins, coordinates, and hence the transform, are relative to
/// the target's origin; `in_the_world` and `align_to` convert. The figures of the result are those
/// of the last scale, but `iterations` counts all scales. Points that are not finite are ignored.
/// Throws `invalid_input` for options that make no sense, for points of different dimension, and
/// for points without the colours or the attribute that the metric needs.
/// Bad data does not throw: the status of the result says what is wrong.
export template <MotionModel Model = rigid_motion, PointsSource A, PointsSource B>
  requires std::same_as<points_view_of<A>, points_view_of<B>>
[[nodiscard]] auto align(const A& source, const B& target, const align_options& options = {}) {
  return align_any<Model>(source, target, options,
                          [&](const auto& moving, const auto& onto, const auto& start) {
                            return align_by_options<Model>(moving, onto, start, options);
                          });
}
/// Refused by the compiler with a sentence: source and target must have the same scalar and
/// dimension.
export template <class Model = rigid_motion, PointsSource A, PointsSource B, class... More>
  requires(!std::same_as<points_view_of<A>, points_view_of<B>>)
void align(const A&, const B&, More&&...) {
  static_assert(
      std::same_as<points_view_of<A>, points_view_of<B>>,
      "align: source and target must have the same scalar and dimension; cast one of them, "
      "as by cast<double>(cloud)");
}
export template <class Model = rigid_motion, PointsSource A, PointsSource B>
  requires(!std::same_as<points_view_of<A>, points_view_of<B>>)
void align(const A& source, const B& target, const align_options&) {
  align<Model>(source, target);
}

/// As above, with a metric of yours, or any combination, in place of that of the options. Throws
/// `invalid_input` if the options name a metric, too, or a robust kernel: `weighted_term{metric, 1,
/// {}, kernel}` gives your metric a kernel.
export template <MotionModel Model = rigid_motion, PointsSource A, PointsSource B, class Metric>
  requires std::same_as<points_view_of<A>, points_view_of<B>> &&
           RegistrationMetric<Metric, closed_dimension<dimension_of<A>>>
[[nodiscard]] auto align(const A& source, const B& target, const Metric& metric,
                         const align_options& options = {}) {
  expects(std::holds_alternative<point_to_plane>(options.metric),
          "align: there are two metrics: leave .metric out if you pass one as an argument");
  expects(!options.robust,
          "align: .robust applies to .metric only; give a metric that you pass its kernel by "
          "weighted_term{metric, 1, {}, kernel}");
  expects(options.graduation == 1,
          "align: .graduation applies to .robust only, and there can be none with a metric that "
          "you pass");
  return align_any<Model>(source, target, options,
                          [&](const auto& moving, const auto& onto, const auto& start) {
                            return align_with<Model>(moving, onto, metric, start, options);
                          });
}

/// Refused by the compiler with a sentence: `colored` has no values yet.
export template <MotionModel Model = rigid_motion, PointsSource A, PointsSource B>
void align(const A&, const B&, const colored&, const align_options& = {}) {
  static_assert(!PointsSource<A>,
                "align: colored is chosen in the options, as in align(source, target, {.metric = "
                "colored{}}); a metric with values of yours is colored_point_to_plane");
}

/// How well the source lies on the target under a given transform, of any scalar: the figures that
/// `align` returns for its result.
export template <MotionModel Model = rigid_motion, PointsSource A, PointsSource B>
  requires std::same_as<points_view_of<A>, points_view_of<B>>
[[nodiscard]] alignment_fit evaluate(const A& source, const B& target,
                                     const any_transform& transform, align_options options = {}) {
  options.initial = transform;
  options.max_iterations = 0;
  options.graduation = 1;
  if (options.scales.size() > 1)
    options.scales.erase(options.scales.begin(), options.scales.end() - 1);
  return align<Model>(source, target, options);
}

#define CILANTRO_COMPILED_ELSEWHERE(S, D)                                                        \
  extern template prepared_points<S, D> prepare(const align_input<S, D>&, double, bool,          \
                                                const neighborhood_spec&, const execution&);     \
  extern template icp_result<rigid_transform<S, D>> align_scales<S, D, rigid_transform<S, D>>(   \
      const align_input<S, D>&, const align_input<S, D>&,                                        \
      const align_start<rigid_transform<S, D>>&, const align_options&, bool, bool,               \
      const estimator_maker<S, D, rigid_transform<S, D>>&);                                      \
  extern template icp_result<affine_transform<S, D>> align_scales<S, D, affine_transform<S, D>>( \
      const align_input<S, D>&, const align_input<S, D>&,                                        \
      const align_start<affine_transform<S, D>>&, const align_options&, bool, bool,              \
      const estimator_maker<S, D, affine_transform<S, D>>&);
CILANTRO_FOR_CLOSED_SPACES(CILANTRO_COMPILED_ELSEWHERE)
#undef CILANTRO_COMPILED_ELSEWHERE

#define CILANTRO_COMPILED_ELSEWHERE(S, D)                                                   \
  extern template icp_result<rigid_transform<S, D>> align_by_options<rigid_motion, S, D>(   \
      const align_input<S, D>&, const align_input<S, D>&,                                   \
      const align_start<rigid_transform<S, D>>&, const align_options&);                     \
  extern template icp_result<affine_transform<S, D>> align_by_options<affine_motion, S, D>( \
      const align_input<S, D>&, const align_input<S, D>&,                                   \
      const align_start<affine_transform<S, D>>&, const align_options&);                    \
  extern template icp_result<rigid_transform<S, D>> align_colored<rigid_motion, S, D>(      \
      const align_input<S, D>&, const align_input<S, D>&, const colored&,                   \
      const align_start<rigid_transform<S, D>>&, const align_options&);                     \
  extern template icp_result<affine_transform<S, D>> align_colored<affine_motion, S, D>(    \
      const align_input<S, D>&, const align_input<S, D>&, const colored&,                   \
      const align_start<affine_transform<S, D>>&, const align_options&);
CILANTRO_FOR_CLOSED_SPACES(CILANTRO_COMPILED_ELSEWHERE)
#undef CILANTRO_COMPILED_ELSEWHERE

}  // namespace cilantro
