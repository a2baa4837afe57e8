// SPDX-License-Identifier: MIT
module cilantro.registration;

namespace cilantro {
namespace {

template <class Pair>
auto by_source(const Pair& p) {
  return std::tuple{p.source, p.target};
}
template <class Pair>
auto by_distance(const Pair& p) {
  return std::tuple{p.distance, p.source, p.target};
}

/// Of the pairs with the same `point`, keeps the one of the least distance.
template <class Pairs, class Point>
void keep_nearest_of_each(Pairs& pairs, Point point) {
  std::ranges::sort(pairs, {}, [&](const auto& p) {
    return std::tuple_cat(std::tuple{point(p)}, by_distance(p));
  });
  const auto rest = std::ranges::unique(pairs, {}, point);
  pairs.erase(rest.begin(), rest.end());
}

/// From the least distance on, keeps what meets none of the points that are already taken.
template <class Pairs>
void keep_greedily(Pairs& pairs) {
  std::ranges::sort(pairs, {}, [](const auto& p) { return by_distance(p); });
  std::vector<bool> sources, targets;  // Those that are taken.
  const auto place = [](std::vector<bool>& taken, std::int32_t i) {
    const auto at = static_cast<std::size_t>(i);
    if (at >= taken.size()) taken.resize(at + 1);
    return taken.begin() + i;
  };
  std::erase_if(pairs, [&](const auto& p) {
    const auto source = place(sources, p.source), target = place(targets, p.target);
    if (*source || *target) return true;
    *source = *target = true;
    return false;
  });
}

}  // namespace

void expect_valid(const correspondence_options& options) {
  expect_from(0, options.max_distance, "correspondences: max_distance");
  expects(options.fraction > 0 && options.fraction <= 1,
          "correspondences: fraction must be above 0, and at most 1, and is " +
              in_digits(options.fraction));
}

template <Scalar S>
void select_correspondences(correspondences<S>& pairs, const correspondence_options& options) {
  expect_valid(options);
  const S limit = static_cast<S>(options.max_distance);
  std::erase_if(pairs, [&](const auto& p) { return !(p.distance <= limit); });
  switch (options.one_to_one) {
    case sides::none:
      break;
    case sides::source:
      keep_nearest_of_each(pairs, [](const auto& p) { return p.source; });
      break;
    case sides::target:
      keep_nearest_of_each(pairs, [](const auto& p) { return p.target; });
      break;
    case sides::both:
      keep_greedily(pairs);
      break;
  }
  if (options.fraction < 1) {
    const auto kept =
        static_cast<std::ptrdiff_t>(std::ceil(options.fraction * double(pairs.size())));
    std::ranges::nth_element(pairs, pairs.begin() + kept, {},
                             [](const auto& p) { return by_distance(p); });
    pairs.resize(kept);
  }
  if (!std::ranges::is_sorted(pairs, {}, [](const auto& p) { return by_source(p); }))
    std::ranges::sort(pairs, {}, [](const auto& p) { return by_source(p); });
}

template void select_correspondences(correspondences<float>&, const correspondence_options&);
template void select_correspondences(correspondences<double>&, const correspondence_options&);

}  // namespace cilantro
