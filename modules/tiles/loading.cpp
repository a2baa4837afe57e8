// SPDX-License-Identifier: MIT
module cilantro.tiles;

import cilantro.eigen;
import :loading;
import :places;
import :region;
import :survey;

namespace cilantro {
namespace {

/// A number and its index.
using numbered = std::pair<std::uint64_t, std::int32_t>;

/// Numbers in ascending order, and equal ones as they come. Those of a few sequences that ascend
/// are merged.
std::vector<numbered> ascending(std::span<const std::uint64_t> numbers) {
  std::vector<numbered> all(numbers.size()), next(numbers.size());
  std::vector<std::size_t> ends;
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    all[i] = {numbers[i], static_cast<std::int32_t>(i)};
    if (i + 1 == numbers.size() || numbers[i + 1] < numbers[i]) ends.push_back(i + 1);
  }
  while (ends.size() > 1) {
    std::vector<std::size_t> merged_ends;
    for (std::size_t r = 0, begin = 0; r < ends.size(); r += 2) {
      const auto middle = ends[r], end = r + 1 < ends.size() ? ends[r + 1] : middle;
      const auto at = [&](std::size_t i) { return all.begin() + static_cast<std::ptrdiff_t>(i); };
      std::merge(at(begin), at(middle), at(middle), at(end),
                 next.begin() + static_cast<std::ptrdiff_t>(begin));
      merged_ends.push_back(begin = end);
    }
    all.swap(next);
    ends = std::move(merged_ends);
  }
  return all;
}

/// Points of one file after the other.
template <Scalar S, int D>
class region_loader {
 public:
  region_loader(const tile_survey<D>& survey, const std::stop_token& stop)
      : survey_{survey}, stop_{stop} {}

  /// The points of a region that are not in another one, whose points were loaded before.
  void load(const tile_region<D>& region, const tile_region<D>* known = nullptr) {
    const auto has_wanted = [&](const extent<D>& box) {
      // Boxes were not rounded as points are.
      return region.may_meet(box) &&
             (known == nullptr || !known->contains(box, survey_.template slack<S>()));
    };
    for (const auto& range : survey_.files.ranges(has_wanted)) load(range, region, known);
    expects(std::ssize(order_) <= std::numeric_limits<std::int32_t>::max(),
            "a tile with its surroundings has 2^31 points or more: open it with a smaller .edge");
  }

  /// The places of all points, in no order.
  [[nodiscard]] point_matrix<S, D> places() const {
    point_matrix<S, D> all(D, std::ssize(order_));
    index_t at = 0;
    for (const auto& part : parts_) {
      all.middleCols(at, part.size()) = part.points;
      at += part.size();
    }
    return all;
  }

  loaded_points<S, D> result() && {
    reader_.reset();
    for (std::size_t i = 1; i < parts_.size(); ++i) parts_[i].comments.clear();
    loaded_points<S, D> all{append_all(parts_), std::move(order_)};
    parts_.clear();
    all.cloud.origin = survey_.origin;
    if (!std::ranges::is_sorted(all.order)) {
      const auto sorted = ascending(all.order);
      index_list indices(sorted.size());
      std::ranges::transform(sorted, indices.begin(), &numbered::second);
      std::ranges::transform(sorted, all.order.begin(), &numbered::first);
      all.cloud = select(all.cloud, indices);
    }
    return all;
  }

 private:
  void load(const point_range& range, const tile_region<D>& region, const tile_region<D>* known) {
    const auto& file = survey_.files[range.file];
    if (!reader_ || range.file != open_) {
      expect_unchanged(file);
      reader_.emplace(file.path, read_options{.monitor = {.stop = stop_}});
      reader_->set_origin(survey_.is_local ? point_vector<double, D>::Zero() : survey_.origin);
      open_ = range.file;
    }
    constexpr std::uint64_t at_a_time = 16 * points_of_a_run;
    const auto points_before = survey_.files.points_before(range.file);
    reader_->seek(range.first);
    for (auto first = range.first; first < range.end;) {
      auto piece = reader_->read(static_cast<index_t>(std::min(at_a_time, range.end - first)));
      if (piece.empty()) throw io_error{file.path, "has fewer points than it had"};
      piece.origin = survey_.origin;
      std::vector<std::uint64_t> places;
      if (survey_.is_local) places = take_back(piece);
      index_list wanted;
      for (index_t i = 0; i < piece.size(); ++i) {
        const auto place = world_of<S, D>(piece.points.col(i), survey_.origin);
        if (!is_finite(place) || !region.contains(place)) continue;
        if (known != nullptr && known->contains(place)) continue;
        wanted.push_back(static_cast<std::int32_t>(i));
        order_.push_back(places.empty() ? points_before + first + static_cast<std::uint64_t>(i)
                                        : places[i]);
      }
      first += static_cast<std::uint64_t>(piece.size());
      if (wanted.empty()) continue;
      conform(piece, survey_.parts, file.path);
      parts_.push_back(std::ssize(wanted) == piece.size() ? std::move(piece)
                                                          : select(piece, wanted));
    }
  }

  const tile_survey<D>& survey_;
  const std::stop_token& stop_;
  std::optional<cloud_reader<S, D>> reader_;  ///< Of file number `open_`.
  index_t open_ = 0;
  std::vector<point_cloud<S, D>> parts_;
  std::vector<std::uint64_t> order_;
};

}  // namespace

template <Scalar S, int D>
loaded_points<S, D> load_region(
    const tile_survey<D>& survey, const tile_region<D>& region, const std::stop_token& stop,
    const std::function<std::optional<tile_region<D>>(point_matrix<S, D>)>& more) {
  region_loader<S, D> loader{survey, stop};
  loader.load(region);
  if (more)
    if (const auto also = more(loader.places())) loader.load(*also, &region);
  return std::move(loader).result();
}

#define CILANTRO_INSTANTIATE(S, D)                                          \
  template loaded_points<S, D> load_region(                                 \
      const tile_survey<D>&, const tile_region<D>&, const std::stop_token&, \
      const std::function<std::optional<tile_region<D>>(point_matrix<S, D>)>&);
CILANTRO_INSTANTIATE(float, 2)
CILANTRO_INSTANTIATE(float, 3)
CILANTRO_INSTANTIATE(double, 2)
CILANTRO_INSTANTIATE(double, 3)
#undef CILANTRO_INSTANTIATE

}  // namespace cilantro
