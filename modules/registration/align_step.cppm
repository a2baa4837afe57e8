// SPDX-License-Identifier: MIT
export module cilantro.registration:align_step;

import cilantro.standard;
import cilantro.core;
import cilantro.cloud;
import :align;
import :icp;
import :motion;

namespace cilantro {

/// Thrown by `align_to`, and so by pipelines that use it, if a cloud could not be aligned.
export class alignment_failed : public std::runtime_error {
 public:
  explicit alignment_failed(icp_status why)
      : std::runtime_error{"align_to: no transform was found (" + std::string{to_string(why)} +
                           ")"},
        status_{why} {}
  /// Why no transform was found.
  [[nodiscard]] icp_status status() const { return status_; }

 private:
  icp_status status_;
};

/// The transform that an alignment has found as a transform of world coordinates, in double. If
/// clouds have origins, the transform in the result is relative to the target's origin, while
/// `transform(source, …)` expects one of world coordinates. `align_to` moves the cloud itself.
export template <class T, Scalar S, int D>
  requires std::same_as<T, rigid_transform<S, D>> || std::same_as<T, affine_transform<S, D>>
[[nodiscard]] auto in_the_world(const icp_result<T>& found, const point_cloud<S, D>& target) {
  using world =
      std::conditional_t<RigidMap<T>, rigid_transform<double, D>, affine_transform<double, D>>;
  const auto linear = found.transform.linear().template cast<double>().eval();
  const point_vector<double, D> origin = target.full_origin();
  return make_transform<world>(
      linear,
      (found.transform.translation().template cast<double>() + origin - linear * origin).eval());
}

/// The cloud moved onto `target`, with the target's origin. If `found` is given, the result of the
/// alignment is written to it, and the caller must check its status. Otherwise, throws
/// `alignment_failed` if there were too few pairs or they do not determine the transform, and
/// `cancelled`.
export template <Scalar S, int D>
[[nodiscard]] point_cloud<S, D> align_to(
    point_cloud<S, D> cloud, const point_cloud<S, D>& target, const align_options& options = {},
    std::type_identity_t<icp_result<rigid_transform<S, D>>>* found = nullptr) {
  auto result = align(cloud, target, options);
  if (!found) {
    if (result.status == icp_status::cancelled) throw cancelled{};
    if (result.status == icp_status::too_few_pairs || result.status == icp_status::degenerate)
      throw alignment_failed{result.status};
  }
  const Eigen::VectorXd shift = shift_between(cloud, target);
  cloud.origin.setZero();
  cloud = transform(
      std::move(cloud),
      make_transform<rigid_transform<S, D>>(
          result.transform.linear(),
          (result.transform.translation() + result.transform.linear() * shift.cast<S>()).eval()));
  cloud.origin = target.origin;
  if (found) *found = std::move(result);
  return cloud;
}

/// `align_to` of clouds as a step. Members are its arguments: `target`, `options` and `found`.
export template <Scalar S, int D>
struct align_to_step : pipeline_step {
  point_cloud<S, D> target;
  align_options options;
  icp_result<rigid_transform<S, D>>* found;

  static constexpr const char* name = "align_to";
  /// Whether a result is written to `found`.
  [[nodiscard]] bool writes_outside() const { return found != nullptr; }
  align_to_step(point_cloud<S, D> onto, align_options how,
                icp_result<rigid_transform<S, D>>* result)
      : target(std::move(onto)), options(std::move(how)), found(result) {}
  /// How far around a point it looks.
  static step_reach reach() { return {.everything = true}; }
  point_cloud<S, D> operator()(point_cloud<S, D> cloud) const {
    return align_to(std::move(cloud), target, options, found);
  }
};
/// The step that moves clouds onto `target`. It keeps a copy of the target, so that it can be
/// stored and applied to many frames.
export template <Scalar S, int D>
[[nodiscard]] auto align_to(
    point_cloud<S, D> target, align_options options = {},
    std::type_identity_t<icp_result<rigid_transform<S, D>>>* found = nullptr) {
  return align_to_step<S, D>{std::move(target), std::move(options), found};
}

}  // namespace cilantro
