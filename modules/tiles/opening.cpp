// SPDX-License-Identifier: MIT
module;
#include <unistd.h>
#include <cctype>

#include "core/parallel_backend.hpp"
module cilantro.tiles;

import cilantro.eigen;
import :index_file;
import :places;
import :survey;

namespace cilantro {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t most_squares = 10'000'000;
constexpr const char* too_many_tiles =
    "open_tiles: with this edge there are more than 10 million tiles";

/// Counts points in squares whose edge doubles while there are too many, unless it is given.
class square_histogram {
 public:
  explicit square_histogram(double edge) : edge_{edge}, is_given_{edge > 0} {}

  [[nodiscard]] double edge() const { return edge_; }
  [[nodiscard]] square_counts take() && { return std::move(counts_); }
  [[nodiscard]] const square_counts& counts() const { return counts_; }

  template <int D>
  void add(std::span<const point_vector<double, D>> places) {
    if (places.empty()) return;
    if (edge_ == 0) edge_ = first_edge<D>(places);
    for (const auto& place : places) {
      constexpr double too_many = 0x1p53;
      if (!(std::max(std::abs(place[0]), std::abs(place[1])) < too_many * edge_)) {
        expects(!is_given_, "open_tiles: the edge is too small for the coordinates of the points");
        while (!(std::max(std::abs(place[0]), std::abs(place[1])) < too_many * edge_))
          coarsen(2 * edge_);
      }
      const auto key = key_of(place, edge_);
      // Neighbours in a file are mostly neighbours in space.
      if (last_ == counts_.end() || last_->first != key) last_ = counts_.try_emplace(key).first;
      ++last_->second;
      if (is_given_)
        expects(counts_.size() <= most_squares, too_many_tiles);
      else if (counts_.size() > 65'536)
        coarsen(2 * edge_);
    }
  }
  /// Adds what was counted with the same edge.
  void add(const square_counts& more) {
    for (const auto& [key, count] : more) counts_[key] += count;
  }
  /// `edge` is a whole multiple.
  void coarsen(double edge) {
    const double times = edge / edge_;
    square_counts coarse;
    for (const auto& [key, count] : counts_)
      coarse[{static_cast<std::int64_t>(std::floor(double(key.x) / times)),
              static_cast<std::int64_t>(std::floor(double(key.y) / times))}] += count;
    counts_ = std::move(coarse);
    last_ = counts_.end();
    edge_ = edge;
  }

 private:
  /// By where most points are: one that is far away must not make the squares of all others large.
  template <int D>
  static double first_edge(std::span<const point_vector<double, D>> places) {
    double size = 0, most_size = 0;
    std::vector<double> along(places.size());
    for (int d = 0; d < 2; ++d) {
      std::ranges::transform(places, along.begin(), [d](const auto& place) { return place[d]; });
      std::ranges::sort(along);
      const std::size_t few = along.size() / 20;
      size = std::max(size, along[along.size() - 1 - few] - along[few]);
      most_size = std::max(most_size, along.back() - along.front());
    }
    if (size == 0) size = most_size;
    return size > 0 ? std::exp2(std::floor(std::log2(size / 256))) : 1;
  }

  double edge_;
  bool is_given_;
  square_counts counts_;
  square_counts::iterator last_ = counts_.end();
};

/// Reads a file once, to know where its points are.
template <Scalar S, int D>
std::pair<survey_file<D>, square_histogram> scan(
    const fs::path& path, const std::optional<point_vector<double, D>>& origin, double edge,
    const task_monitor& monitor) {
  survey_file<D> file;
  file.path = path;
  square_histogram squares{edge};
  cloud_reader<S, D> reader{path, {.monitor = {.stop = monitor.stop}}};
  if (origin) reader.set_origin(*origin);
  std::error_code error;
  file.bytes = fs::file_size(path, error);
  if (const auto time = fs::last_write_time(path, error); !error)
    file.modified = time.time_since_epoch().count();
  std::vector<point_vector<double, D>> places;
  for (auto piece = reader.read(16 * points_of_a_run); !piece.empty();
       piece = reader.read(16 * points_of_a_run)) {
    if (monitor.stop.stop_requested()) throw cancelled{};
    places.clear();
    const auto from = piece.full_origin();
    for (index_t i = 0; i < piece.size(); ++i) {
      if (i % points_of_a_run == 0) file.runs.emplace_back();
      ++file.runs.back().count;
      const auto place = world_of<S, D>(piece.points.col(i), from);
      if (!is_finite(place)) continue;
      file.runs.back().box.add(place);
      places.push_back(place);
    }
    squares.add<D>(places);
    file.points += static_cast<std::uint64_t>(piece.size());
  }
  return {std::move(file), std::move(squares)};
}

/// Whether a name is one of those that a pattern with * and ? means.
bool matches(std::string_view name, std::string_view pattern) {
  std::size_t n = 0, p = 0, star = pattern.npos, after_star = 0;
  while (n < name.size()) {
    if (p < pattern.size() && (pattern[p] == '?' || pattern[p] == name[n])) {
      ++n;
      ++p;
    } else if (p < pattern.size() && pattern[p] == '*') {
      star = p++;
      after_star = n;
    } else if (star != pattern.npos) {
      p = star + 1;
      n = ++after_star;
    } else {
      return false;
    }
  }
  return pattern.find_first_not_of('*', p) == pattern.npos;
}

bool is_cloud_file(const fs::path& path) {
  std::string ending = path.extension().string();
  for (char& c : ending) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  constexpr std::array known{".ply", ".pcd", ".xyz", ".txt", ".asc", ".csv", ".pts",
                             ".npy", ".bin", ".las", ".laz", ".e57", ".ptx"};
  return std::ranges::find(known, ending) != known.end();
}

std::vector<fs::path> files_of(const fs::path& files) {
  const auto pattern = files.filename().string();
  std::error_code error;
  const bool is_folder = fs::is_directory(files, error);
  if (!is_folder && fs::exists(files, error)) return {files};
  if (!is_folder && pattern.find_first_of("*?") == pattern.npos)
    throw io_error{files, "cannot be read: there is no such file or folder"};
  if (is_folder && has_notes(files))
    throw invalid_input{"open_tiles: \"" + files.string() +
                        "\" has only some of the tiles of a run that was interrupted: let it go on "
                        "with {.resume = true}, or name the files"};
  const auto folder = is_folder ? files : files.has_parent_path() ? files.parent_path() : ".";
  std::vector<fs::path> found;
  for (fs::directory_iterator at{folder, error}, end; !error && at != end; at.increment(error))
    if (is_folder ? is_cloud_file(at->path()) : matches(at->path().filename().string(), pattern))
      found.push_back(at->path());
  if (error) throw io_error{folder, "cannot be read: " + error.message()};
  std::ranges::sort(found);
  expects(!found.empty(), "open_tiles: there is no file \"" +
                              (is_folder ? files / "*" : files).string() +
                              "\" that is known as one of points");
  return found;
}

std::uint64_t memory_of_machine() {
  return static_cast<std::uint64_t>(::sysconf(_SC_PHYS_PAGES)) *
         static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
}

/// The first points decide what all have, and the origin.
template <Scalar S, int D>
void look_at_first_points(tile_survey<D>& survey, std::optional<point_vector<double, D>>& origin,
                          std::span<const fs::path> files, const task_monitor& monitor) {
  for (const auto& path : files) {
    cloud_reader<S, D> reader{path, {.monitor = {.stop = monitor.stop}}};
    if (origin) reader.set_origin(*origin);
    auto piece = reader.read(16 * points_of_a_run);
    if (piece.empty()) continue;
    if (survey.is_local) take_back(piece);
    survey.parts = parts_of(piece);
    if (!origin) origin = piece.full_origin();
    return;
  }
}

/// Whether all points lie around the origin, so that larger squares would have the same points.
bool are_around_origin(const square_counts& counts) {
  return std::ranges::all_of(counts, [](const auto& counted) {
    const auto& [x, y] = counted.first;
    return -1 <= x && x <= 0 && -1 <= y && y <= 0;
  });
}

/// The largest edge with which no tile has more points than are handled well: those that were
/// counted times 2, 3, 4, 6, 8, 12 and so on.
double choose_edge(const square_histogram& finest, double most_points) {
  double edge = finest.edge();
  constexpr int most_doublings = 60;
  for (int doublings = 1; doublings < most_doublings; ++doublings)
    for (const double more : {1.0, 1.5}) {
      auto next = finest;
      next.coarsen(std::ldexp(more * finest.edge(), doublings));
      std::uint64_t most = 0;
      for (const auto& [key, count] : next.counts()) most = std::max(most, count);
      if (double(most) > most_points) return edge;
      edge = next.edge();
      if (next.counts().size() <= 1 || are_around_origin(next.counts())) return edge;
    }
  return edge;
}

template <Scalar S, int D>
void scan_files(tile_survey<D>& survey, std::span<const fs::path> files,
                const std::optional<point_vector<double, D>>& origin, const tile_options& options) {
  std::vector<std::optional<square_histogram>> squares(files.size());
  std::atomic<std::size_t> squares_in_all = 0;
  std::vector<survey_file<D>> scanned(files.size());
  parallel_blocks(
      std::ssize(files), 1, {options.threads, options.monitor}, [&](index_t f, index_t, index_t) {
        auto [file, counted] = scan<S, D>(files[f], origin, options.edge, options.monitor);
        // Of one file at most 65536, if their edge was not given.
        if (options.edge > 0)
          expects((squares_in_all += counted.counts().size()) <= 4 * most_squares, too_many_tiles);
        scanned[f] = std::move(file);
        squares[f] = std::move(counted);
      });
  survey.edge = options.edge;
  if (survey.edge == 0) {
    double coarsest = 0;
    for (const auto& s : squares) coarsest = std::max(coarsest, s->edge());
    if (coarsest == 0) coarsest = 1;
    square_histogram all{coarsest};
    for (auto& s : squares) {
      if (s->counts().empty()) continue;
      s->coarsen(coarsest);
      all.add(s->counts());
    }
    constexpr double usual = 2e6;
    const int threads = survey.threads > 0 ? survey.threads : detail::threads_of_part(1);
    survey.edge = choose_edge(all, std::min(usual, double(survey.memory) / threads / 1.5 /
                                                       bytes_per_point<S, D>(survey.parts)));
    for (auto& s : squares)
      if (!s->counts().empty()) s->coarsen(survey.edge);
  }
  for (std::size_t f = 0; f < files.size(); ++f) scanned[f].squares = std::move(*squares[f]).take();
  survey.files = {std::move(scanned), {options.threads}};
}

}  // namespace

template <Scalar S, int D>
  requires(D == 2 || D == 3)
tiled_cloud<S, D> open_tiles(std::span<const fs::path> files, const tile_options& options) {
  expect_between(0, options.edge, 1e300, "open_tiles: edge");
  expect_from(0, options.threads, "open_tiles: threads");
  auto survey = std::make_shared<tile_survey<D>>();
  survey->memory = options.memory > 0 ? options.memory : memory_of_machine() / 2;
  survey->threads = options.threads;
  std::optional<point_vector<double, D>> origin;
  std::optional<tile_index<D>> index;
  if (files.size() == 1) index = read_index<D>(files[0]);
  const bool is_same = index && index->scalar == (std::same_as<S, float> ? "float" : "double");
  std::vector<fs::path> all;
  for (const auto& path : files) {
    const auto some = index ? std::vector<fs::path>{} : files_of(path);
    all.insert(all.end(), some.begin(), some.end());
  }
  if (index)
    for (const auto& file : index->files) all.push_back(file.path);
  if (is_same) origin = index->origin;
  survey->is_local = is_same && index->is_local;
  look_at_first_points<S, D>(*survey, origin, all, options.monitor);
  if (origin) survey->origin = *origin;
  if (is_same && (options.edge == 0 || options.edge == index->edge)) {
    survey->edge = index->edge;
    survey->files = {std::move(index->files), {options.threads}};
  } else {
    auto how = options;
    if (index && how.edge == 0) how.edge = index->edge;
    scan_files<S, D>(*survey, all, origin, how);
  }
  join_files(*survey);
  expects(survey->tiles.size() <= most_squares, too_many_tiles);
  return {std::move(survey), {}};
}

template <Scalar S, int D>
  requires(D == 2 || D == 3)
tiled_cloud<S, D> open_tiles(const fs::path& files, const tile_options& options) {
  return open_tiles<S, D>(std::span{&files, 1}, options);
}

template <Scalar S, int D>
void expect_steps_on_tiles(const std::vector<tile_step<S, D>>& steps) {
  std::string moved_by;
  for (const auto& step : steps) {
    expects(!step.writes_outside,
            "the step " + step.name +
                " writes to something that all tiles would share; write_tiles writes tiles");
    expects(!step.reach.everything, "the step " + step.name +
                                        " looks at the whole cloud, so that it cannot be applied "
                                        "to one tile after the other");
    expects(moved_by.empty() || step.reach == step_reach{},
            "the step " + step.name + " looks around points after " + moved_by +
                " has moved them: write the moved tiles, open these, and go on from there");
    if (step.moves_points) moved_by = step.name;
  }
}

#define CILANTRO_INSTANTIATE(S, D)                                                       \
  template tiled_cloud<S, D> open_tiles(std::span<const fs::path>, const tile_options&); \
  template tiled_cloud<S, D> open_tiles(const fs::path&, const tile_options&);           \
  template void expect_steps_on_tiles(const std::vector<tile_step<S, D>>&);
CILANTRO_INSTANTIATE(float, 2)
CILANTRO_INSTANTIATE(float, 3)
CILANTRO_INSTANTIATE(double, 2)
CILANTRO_INSTANTIATE(double, 3)
#undef CILANTRO_INSTANTIATE

}  // namespace cilantro
