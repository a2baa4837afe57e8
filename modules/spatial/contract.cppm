// SPDX-License-Identifier: MIT
export module cilantro.spatial:contract;

import cilantro.standard;
import cilantro.eigen;
import cilantro.core;
import cilantro.geometry;

namespace cilantro {

/// Tests a region of yours on `points`, which should be inside and outside: that it gives the same
/// answer twice, for any thread, and one point at a time as for many at once, if it has
/// `mark_inside`; that `check`, if it has one, accepts the dimension of the points and refuses
/// another. Returns a sentence for each rule that is broken.
export template <PointsSource P, Region<dimension_of<P>> R>
[[nodiscard]] std::vector<std::string> check_region(const R& region, const P& points) {
  constexpr int D = dimension_of<P>;
  std::vector<std::string> violations;
  const auto expect = [&](bool condition, const char* rule) {
    if (!condition) violations.emplace_back(rule);
  };
  const auto view = points_in(points);
  const Eigen::VectorXd origin = origin_in(points);
  if constexpr (requires { region.check(index_t{}); }) {
    const auto accepts = [&](index_t dimension) {
      try {
        region.check(dimension);
        return true;
      } catch (const invalid_input&) {
        return false;
      }
    };
    expect(accepts(view.dimension()), "check refuses the dimension of the points");
    expect(!accepts(view.dimension() + 1),
           "check accepts another dimension than that of the region");
    if (!violations.empty()) return violations;
  }
  std::vector<std::uint8_t> first(view.size()), second(view.size());
  const auto ask_all = [&](std::vector<std::uint8_t>& answers) {
    parallel_blocks(view.size(), 16, {.threads = 4}, [&](index_t, index_t begin, index_t end) {
      for (index_t i = begin; i < end; ++i) {
        if (!is_finite(view[i])) continue;
        const point_vector<double, D> place = view[i].template cast<double>() + origin;
        answers[i] = is_inside<D>(region, place);
      }
    });
  };
  ask_all(first);
  ask_all(second);
  expect(first == second, "two calls for the same point give different answers");
  const auto is_in = [](std::uint8_t answer) { return answer != 0; };
  expect(std::ranges::any_of(first, is_in) && !std::ranges::all_of(first, is_in),
         "all points are on one side; give points that are inside and outside");
  if constexpr (requires {
                  region.mark_inside(points_view<scalar_of<P>, dynamic>{view}, origin,
                                     std::span{second});
                }) {
    second.assign(second.size(), std::uint8_t{2});
    region.mark_inside(points_view<scalar_of<P>, dynamic>{view}, origin, std::span{second});
    expect(first == second, "mark_inside and contains give different answers");
  }
  return violations;
}

}  // namespace cilantro
