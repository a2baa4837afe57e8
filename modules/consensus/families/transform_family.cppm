// SPDX-License-Identifier: MIT
export module cilantro.consensus:transform_family;

import cilantro.standard;
import cilantro.core;
import :sample;

namespace cilantro {

/// Which transforms a `transform_family` contains.
export enum class transform_kind {
  rigid,       ///< A rotation and a translation.
  similarity,  ///< A rotation, a translation and a scale.
  affine,      ///< Any linear map, and a translation.
};

/// The least-squares transform; nothing if the source does not determine it.
[[nodiscard]] std::optional<affine_parts<double, dynamic>> fit_transform(
    transform_kind kind, const std::optional<gathered_points>& source,
    const std::optional<gathered_points>& target, double negligible);

template <Scalar S, int D>
double pair_distance(points_view<S, D> source, points_view<S, D> target,
                     const Eigen::Matrix<S, D, D>& linear, const point_vector<S, D>& translation,
                     index_t s, index_t t);

/// Transforms that map the source point of each pair to its target point, in any dimension. A
/// sample has as many pairs as determine a transform: Dim for rigid transforms and similarities
/// (but 2 for a similarity in 1D), Dim + 1 for affine ones; it is degenerate if its source points
/// lie in too small a subspace to determine one. The residual is the distance between the mapped
/// source point and the target point. Views the points, which must outlive it; make one by
/// `rigid_family`, `similarity_family` or `affine_family`.
/// Source: Umeyama 1991, "Least-squares estimation of transformation parameters".
export template <Scalar S, int D, transform_kind Kind>
class transform_family {
 public:
  using model_type = std::conditional_t<Kind == transform_kind::rigid, rigid_transform<S, D>,
                                        affine_transform<S, D>>;

  /// Pair i has source point `sources[i]` and target point `targets[i]`; if both lists are empty,
  /// the i-th point of each. Throws `invalid_input` for different sizes or dimensions, and for an
  /// index that is out of range.
  transform_family(points_view<S, D> source, points_view<S, D> target, index_list sources = {},
                   index_list targets = {})
      : target_{target},
        source_{source},
        targets_{std::move(targets)},
        sources_{std::move(sources)} {
    expects(targets_.size() == sources_.size() &&
                (!targets_.empty() || target_.size() == source_.size()),
            "transform_family: there must be as many target points as source points");
    expects(target_.empty() || source_.empty() || target_.dimension() == source_.dimension(),
            "transform_family: target and source must have the same dimension");
    for (std::size_t i = 0; i < targets_.size(); ++i)
      expects(0 <= targets_[i] && targets_[i] < target_.size() && 0 <= sources_[i] &&
                  sources_[i] < source_.size(),
              "transform_family: the index of a pair is out of range");
  }

  [[nodiscard]] index_t size() const {
    return targets_.empty() ? source_.size() : std::ssize(targets_);
  }
  [[nodiscard]] index_t sample_size() const {
    const index_t d = source_.dimension();
    if constexpr (Kind == transform_kind::affine) return d + 1;
    return std::max<index_t>(d, Kind == transform_kind::rigid ? 1 : 2);
  }
  [[nodiscard]] std::optional<model_type> fit(std::span<const std::int32_t> indices) const {
    const auto found = fit_transform(
        Kind, gather_points<S, closed>(source_, chosen(sources_, indices)),
        gather_points<S, closed>(target_, chosen(targets_, indices)), negligible_ratio<S>);
    if (!found) return std::nullopt;
    return make_transform<model_type>(found->linear, found->translation);
  }
  [[nodiscard]] double residual(const model_type& model, index_t i) const {
    const auto at = static_cast<std::size_t>(i);
    return pair_distance<S, closed>(source_, target_, model.linear(), model.translation(),
                                    sources_.empty() ? i : sources_[at],
                                    targets_.empty() ? i : targets_[at]);
  }

 private:
  static constexpr int closed = closed_dimension<D>;

  static index_list chosen(const index_list& all, std::span<const std::int32_t> indices) {
    index_list some(indices.begin(), indices.end());
    if (!all.empty())
      for (auto& i : some) i = all[i];
    return some;
  }

  points_view<S, D> target_, source_;
  index_list targets_, sources_;
};

template <transform_kind Kind, BorrowedPoints P, BorrowedPoints Q>
[[nodiscard]] auto transforms_between(P&& source, Q&& target) {
  expect_same_origin(source, target, "transform_family");
  using view = points_view_of<P>;
  return transform_family<typename view::scalar, view::static_dimension, Kind>{
      as_points(std::forward<P>(source)), as_points(std::forward<Q>(target))};
}
/// A range of pairs of indices with members `source` and `target`, such as the correspondences of a
/// registration.
export template <class R>
concept PairRange = std::ranges::input_range<R> && requires(std::ranges::range_value_t<R> pair) {
  { pair.target } -> std::convertible_to<index_t>;
  { pair.source } -> std::convertible_to<index_t>;
};
template <transform_kind Kind, BorrowedPoints P, BorrowedPoints Q, PairRange R>
[[nodiscard]] auto transforms_between(P&& source, Q&& target, const R& pairs) {
  expect_same_origin(source, target, "transform_family");
  using view = points_view_of<P>;
  index_list targets, sources;
  for (const auto& pair : pairs) {
    targets.push_back(static_cast<std::int32_t>(pair.target));
    sources.push_back(static_cast<std::int32_t>(pair.source));
  }
  // Without pairs, the family is empty, instead of pairing all points.
  const bool none = targets.empty();
  const auto moving = as_points(std::forward<P>(source));
  const auto onto = as_points(std::forward<Q>(target));
  return transform_family<typename view::scalar, view::static_dimension, Kind>{
      none ? moving.slice(0, 0) : moving, none ? onto.slice(0, 0) : onto, std::move(sources),
      std::move(targets)};
}

/// `rigid_family(source, target)`: rigid transforms between the i-th points of both sets.
/// `rigid_family(source, target, pairs)`: between the pairs of a `PairRange`. Throws
/// `invalid_input` for different sizes, dimensions or origins, and for a pair with an index that is
/// out of range.
export template <class... Args>
  requires requires(Args&&... args) {
    transforms_between<transform_kind::rigid>(std::forward<Args>(args)...);
  }
[[nodiscard]] auto rigid_family(Args&&... args) {
  return transforms_between<transform_kind::rigid>(std::forward<Args>(args)...);
}
/// As above, for rigid transforms with a scale.
export template <class... Args>
  requires requires(Args&&... args) {
    transforms_between<transform_kind::similarity>(std::forward<Args>(args)...);
  }
[[nodiscard]] auto similarity_family(Args&&... args) {
  return transforms_between<transform_kind::similarity>(std::forward<Args>(args)...);
}
/// As above, for affine transforms.
export template <class... Args>
  requires requires(Args&&... args) {
    transforms_between<transform_kind::affine>(std::forward<Args>(args)...);
  }
[[nodiscard]] auto affine_family(Args&&... args) {
  return transforms_between<transform_kind::affine>(std::forward<Args>(args)...);
}

}  // namespace cilantro
