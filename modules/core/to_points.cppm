// SPDX-License-Identifier: MIT
export module cilantro.core:to_points;

import cilantro.standard;
import cilantro.eigen;
import :error;
import :points;
import :range_closure;
import :sizes;

namespace cilantro {

/// How one element of a range is read as a point: an Eigen vector of any kind, or a `std::array`.
template <class P>
struct single_point;
template <Scalar S, std::size_t D>
struct single_point<std::array<S, D>> {
  using scalar = S;
  static constexpr int dimension = static_cast<int>(D);
  static auto vector(const std::array<S, D>& p) {
    return Eigen::Map<const point_vector<S, dimension>>{p.data()};
  }
};
template <EigenMatrix V>
  requires Scalar<typename V::Scalar> && (V::ColsAtCompileTime == 1)
struct single_point<V> {
  using scalar = typename V::Scalar;
  static constexpr int dimension = V::RowsAtCompileTime;
  static const V& vector(const V& p) { return p; }
};

/// A range whose elements are points: Eigen vectors, maps and columns, or `std::array`s.
export template <class R>
concept RangeOfPoints = std::ranges::input_range<R> && requires {
  single_point<std::remove_cvref_t<std::ranges::range_reference_t<R>>>::dimension;
};

/// Collects the points of any range, such as a view that filters or computes them, into a `Dim × N`
/// matrix. Throws `invalid_input` if the points differ in dimension.
export template <RangeOfPoints R>
[[nodiscard]] auto to_points(R&& range) {
  using point = single_point<std::remove_cvref_t<std::ranges::range_reference_t<R>>>;
  using S = typename point::scalar;
  constexpr int D = point::dimension;
  std::vector<S> coordinates;
  index_t dimension = D == dynamic ? 0 : D, count = 0;
  for (auto&& element : range) {
    const auto& p = point::vector(element);
    if (count++ == 0) dimension = p.size();
    expect_coordinates(p.size(), dimension);
    for (index_t d = 0; d < dimension; ++d) coordinates.push_back(p[d]);
  }
  return point_matrix<S, D>{
      Eigen::Map<const point_matrix<S, D>>{coordinates.data(), dimension, count}};
}
/// The same, to stand behind `|`: `points | std::views::filter(f) | to_points()`.
export [[nodiscard]] inline auto to_points() {
  return range_closure{
      []<RangeOfPoints R>(R&& range) { return to_points(std::forward<R>(range)); }};
}

}  // namespace cilantro
