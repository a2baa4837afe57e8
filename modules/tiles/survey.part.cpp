// SPDX-License-Identifier: MIT
//
// What is known of a cloud in files. Internal.
module cilantro.tiles:survey;

import cilantro.standard;
import cilantro.core;
import cilantro.cloud;
import :box_tree;
import :tile_step;
import :tiled_cloud;

namespace cilantro {

/// How many consecutive points of a file share a box.
constexpr index_t points_of_a_run = 4096;

/// Which square a place lies in.
struct tile_key {
  std::int64_t x = 0, y = 0;
  friend auto operator<=>(const tile_key&, const tile_key&) = default;
};

/// The square of a coordinate. Precondition: it is finite, and less than 2⁶² edges away from 0.
inline std::int64_t square_of(double coordinate, double edge) {
  return static_cast<std::int64_t>(std::floor(coordinate / edge));
}
template <class P>
tile_key key_of(const P& place, double edge) {
  return {square_of(place[0], edge), square_of(place[1], edge)};
}

/// The square of a tile, with `margin` around it.
inline tile_area area_of(const tile_info& tile, double edge, double margin = 0) {
  return {{double(tile.x) * edge - margin, double(tile.y) * edge - margin},
          {double(tile.x + 1) * edge + margin, double(tile.y + 1) * edge + margin}};
}

/// How many points lie in each square that has some.
using square_counts = std::map<tile_key, std::uint64_t>;

/// Consecutive points of a file, and the box of those that are finite.
template <int D>
struct point_run {
  std::uint32_t count = 0;
  extent<D> box;
};

template <int D>
struct survey_file {
  std::filesystem::path path;
  std::uint64_t bytes = 0;
  std::int64_t modified = 0;  ///< As its clock counts; 0 if that does not matter.
  std::uint64_t points = 0;
  square_counts squares;
  std::vector<point_run<D>> runs;
};

/// Consecutive points of a file.
struct point_range {
  index_t file = 0;
  std::uint64_t first = 0, end = 0;
};

/// The files of a survey and where their points are, which all copies share.
template <int D>
class survey_files {
 public:
  survey_files() = default;
  survey_files(std::vector<survey_file<D>> files, const execution& how) {
    auto all = std::make_shared<content>();
    all->files = std::move(files);
    all->inside.resize(all->files.size());
    parallel_blocks(std::ssize(all->files), 1, how, [&](index_t f, index_t, index_t) {
      const auto& runs = all->files[f].runs;
      auto& inside = all->inside[f];
      std::uint64_t first = 0;
      inside.firsts.reserve(runs.size());
      for (const auto& run : runs) inside.firsts.push_back(std::exchange(first, first + run.count));
      inside.runs = {std::ssize(runs), boxes_of(all->files[f])};
    });
    std::uint64_t points = 0;
    for (std::size_t f = 0; f < all->files.size(); ++f)
      all->inside[f].points_before = std::exchange(points, points + all->files[f].points);
    all->whole = {std::ssize(all->files),
                  [&](index_t f) -> const extent<D>& { return all->inside[f].runs.all(); }};
    content_ = std::move(all);
  }

  [[nodiscard]] std::size_t size() const { return content_->files.size(); }
  [[nodiscard]] bool empty() const { return content_->files.empty(); }
  [[nodiscard]] auto begin() const { return content_->files.begin(); }
  [[nodiscard]] auto end() const { return content_->files.end(); }
  [[nodiscard]] const survey_file<D>& front() const { return content_->files.front(); }
  [[nodiscard]] const survey_file<D>& operator[](index_t f) const { return content_->files[f]; }

  /// The box of all points, and of those of one file.
  [[nodiscard]] const extent<D>& bounds() const { return content_->whole.all(); }
  [[nodiscard]] const extent<D>& bounds(index_t f) const { return content_->inside[f].runs.all(); }
  /// How many points the files before it have.
  [[nodiscard]] std::uint64_t points_before(index_t f) const {
    return content_->inside[f].points_before;
  }

  /// Calls `visit(run)` for each run whose box `meets` a region, in any order.
  template <class M, class F>
  void for_each_run(const M& meets, const F& visit) const {
    content_->find_files(meets, [&](index_t f) {
      content_->find_runs(f, meets, [&](index_t r) { visit(content_->files[f].runs[r]); });
    });
  }
  /// The points of all runs whose boxes meet a region, in the order of the whole.
  template <class M>
  [[nodiscard]] std::vector<point_range> ranges(const M& meets) const {
    index_list files, runs;
    content_->find_files(meets, [&](index_t f) { files.push_back(static_cast<std::int32_t>(f)); });
    std::ranges::sort(files);
    std::vector<point_range> found;
    for (const index_t f : files) {
      runs.clear();
      content_->find_runs(f, meets,
                          [&](index_t r) { runs.push_back(static_cast<std::int32_t>(r)); });
      std::ranges::sort(runs);
      for (const index_t r : runs) {
        const auto first = content_->inside[f].firsts[r];
        const auto end = first + content_->files[f].runs[r].count;
        if (!found.empty() && found.back().file == f && found.back().end == first)
          found.back().end = end;
        else
          found.push_back({f, first, end});
      }
    }
    return found;
  }

 private:
  /// Where the runs of a file are, and the number of its point that each begins with.
  struct file_inside {
    box_tree<D> runs;
    std::vector<std::uint64_t> firsts;
    std::uint64_t points_before = 0;
  };
  struct content {
    std::vector<survey_file<D>> files;
    std::vector<file_inside> inside;
    box_tree<D> whole;

    template <class M, class F>
    void find_files(const M& meets, const F& visit) const {
      whole.find(meets, [&](index_t f) -> const extent<D>& { return inside[f].runs.all(); }, visit);
    }
    template <class M, class F>
    void find_runs(index_t f, const M& meets, const F& visit) const {
      inside[f].runs.find(meets, boxes_of(files[f]), visit);
    }
  };
  static auto boxes_of(const survey_file<D>& file) {
    return [&file](index_t r) -> const extent<D>& { return file.runs[r].box; };
  }

  std::shared_ptr<const content> content_ = std::make_shared<const content>();
};

/// What the points of a survey have beside their coordinates.
struct point_parts {
  bool normals = false, colors = false;
  std::vector<std::pair<std::string, std::size_t>> attributes;  ///< Names, and which type.
  std::vector<std::string> comments;
};

template <int D>
struct tile_survey {
  survey_files<D> files;
  double edge = 0;
  std::uint64_t memory = 0, points = 0;
  int threads = 0;
  point_vector<double, D> origin = point_vector<double, D>::Zero();
  extent<D> bounds;
  std::vector<tile_info> tiles;
  point_parts parts;
  /// Whether the files hold points that were put aside, of which all digits are kept: coordinates
  /// without the origin, colours that were not rounded, and places, if they are known.
  bool is_local = false;

  /// What rounding of coordinates, which are kept as an S relative to the origin, may amount to,
  /// generously.
  template <Scalar S>
  [[nodiscard]] double slack() const {
    double most = 0, kept = 0;
    for (int d = 0; d < D && !bounds.empty(); ++d)
      for (const double bound : {bounds.lower[d], bounds.upper[d]}) {
        most = std::max(most, std::abs(bound));
        kept = std::max(kept, std::abs(bound - origin[d]));
      }
    return most * 0x1p-48 + kept * 8 * double(std::numeric_limits<S>::epsilon());
  }
};

/// A place in world coordinates.
template <Scalar S, int D, class P>
point_vector<double, D> world_of(const P& point, const point_vector<double, D>& origin) {
  return point.template cast<double>() + origin;
}

/// Where the points of `cloud` are once they are written, with or without the origin, and read
/// again.
template <Scalar S, int D>
void describe_points(const point_cloud<S, D>& cloud, double edge, bool is_local,
                     survey_file<D>& file);

/// Fills `tiles`, `bounds` and `points` by what the files are.
template <int D>
void join_files(tile_survey<D>& survey);

/// How many points a rectangle of the first two coordinates has, if those of each run are spread
/// evenly over its box.
template <int D>
double points_within(const survey_files<D>& files, const tile_area& area);

/// Of which files a survey is, in words that are others if one of these is another one: by names,
/// sizes, times and where the points lie.
template <int D>
std::string description_of(const survey_files<D>& files);
/// By which steps it is made another one.
template <Scalar S, int D>
std::string description_of(const std::vector<tile_step<S, D>>& steps);

/// Throws `io_error` if a file is not what it was when it was opened.
template <int D>
void expect_unchanged(const survey_file<D>& file);

/// A piece of a file with the parts that all clouds of the survey have. Throws `io_error` if it
/// lacks some of them.
template <Scalar S, int D>
void conform(point_cloud<S, D>& piece, const point_parts& parts, const std::filesystem::path& path);
template <Scalar S, int D>
point_parts parts_of(const point_cloud<S, D>& cloud);

/// `count` values of type number `type` of those that an attribute can have.
attribute_values values_of_type(std::size_t type, index_t count);

/// How many bytes a point may take while it is worked on.
template <Scalar S, int D>
double bytes_per_point(const point_parts& parts);

}  // namespace cilantro
