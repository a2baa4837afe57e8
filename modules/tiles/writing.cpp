// SPDX-License-Identifier: MIT
module;
#include <algorithm>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <system_error>
#include <utility>
#include <vector>
module cilantro.tiles;

import cilantro.eigen;
import :cutting;
import :communicator;
import :index_file;
import :limits;
import :ranks;
import :running;
import :survey;

namespace cilantro {
namespace {

namespace fs = std::filesystem;

/// A line that tells whether a folder was begun with the same input, steps and options.
template <Scalar S, int D>
std::string description_of(const tiled_cloud<S, D>& cloud, const write_tiles_options& options) {
  const auto& survey = *cloud.survey();
  std::string line = "cilantro tiles 1 unfinished, of " + std::to_string(survey.files.size()) +
                     " files with " + std::to_string(survey.points) + " points from " +
                     (survey.files.empty() ? "nowhere" : survey.files.front().path.string()) +
                     ", edge " + in_digits(survey.edge) + ", " +
                     (std::same_as<S, float> ? "float" : "double") + ", to " + options.format +
                     ", steps:";
  for (const auto& step : cloud.steps())
    line += " | " + step.name + " (" + in_digits(step.reach.distance) + ", " +
            std::to_string(step.reach.neighbors) + ")";
  std::ranges::replace_if(line, [](char c) { return c == '\n' || c == '\r'; }, ' ');
  return line;
}

void make_folder(const fs::path& folder, bool resume) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (!fs::is_directory(folder)) throw io_error{folder, "is no folder, and cannot be made one"};
  const bool is_unfinished = has_notes(folder);
  if (fs::exists(folder / index_name, error))
    throw invalid_input{"write_tiles: \"" + folder.string() +
                        "\" has tiles already, and they are complete"};
  if (is_unfinished && !resume)
    throw invalid_input{"write_tiles: \"" + folder.string() +
                        "\" has tiles of a run that was interrupted: go on with {.resume = true}, "
                        "or remove the folder"};
  if (!is_unfinished && fs::directory_iterator{folder} != fs::directory_iterator{})
    throw invalid_input{"write_tiles: \"" + folder.string() + "\" is not empty"};
}

/// What a killed process has left under names that are not final.
void remove_parts(const fs::path& folder) {
  std::error_code error;
  for (fs::directory_iterator at{folder, error}, end; !error && at != end; at.increment(error)) {
    std::error_code ignored;
    if (at->path().extension() == ".part") fs::remove(at->path(), ignored);
  }
}

/// All tiles of a cloud, none of whose steps measures, into one folder.
template <Scalar S, int D>
class tile_writer {
 public:
  tile_writer(const tiled_cloud<S, D>& cloud, const fs::path& folder, const std::string& what,
              const write_tiles_options& options, const task_monitor& monitor)
      : survey_{*cloud.survey()},
        steps_{cloud.steps()},
        ranks_{cloud.ranks().get()},
        folder_{folder},
        options_{options},
        monitor_{monitor} {
    on_all_ranks(ranks_, [&] {
      for (auto& file : read_notes<D>(folder, what)) {
        std::error_code error;
        // Without points there is no file.
        if (file.points > 0 && (fs::file_size(file.path, error) != file.bytes || error)) continue;
        files_[file.path.filename().string()] = std::move(file);
      }
    });
    on_first_rank(ranks_, [&] { remove_parts(folder); });
    on_all_ranks(ranks_, [&] { notes_.emplace(folder, what, ranks_ ? ranks_->rank : 0); });
  }

  void write() {
    std::vector<index_t> left;
    std::map<tile_key, index_t> wanted;
    for (index_t t = 0; t < std::ssize(survey_.tiles); ++t)
      if (!files_.contains(name_of_tile(t))) {
        left.push_back(t);
        wanted[{survey_.tiles[t].x, survey_.tiles[t].y}] = t;
      }
    std::unique_ptr<tile_cutter<S, D>> cutter;
    const auto monitor = steps_.empty() ? in_passes(monitor_, 2) : monitor_;
    if (steps_.empty() && !left.empty())
      cutter = std::make_unique<tile_cutter<S, D>>(survey_, ranks_, wanted, folder_,
                                                   points_at_a_time(), monitor);
    on_all_ranks(ranks_, [&] {
      run_all<D>(
          survey_, ranks_, left,
          [&](index_t t) { return memory_of<S, D>(survey_, steps_, survey_.tiles[t], 0); },
          [&](index_t t) {
            keep(t, cutter ? cutter->tile(t)
                           : run_tile<S, D>(survey_, steps_, survey_.tiles[t], 0, monitor_.stop));
          },
          monitor);
    });
    finish();
  }

 private:
  [[nodiscard]] std::string name_of_tile(index_t t) const {
    const auto& tile = survey_.tiles[t];
    return std::to_string(tile.x) + '_' + std::to_string(tile.y) + options_.format;
  }
  /// A piece, and its points once more, sorted.
  [[nodiscard]] index_t points_at_a_time() const {
    const double fit = double(survey_.memory) / 2 / bytes_per_point<S, D>(survey_.parts);
    return static_cast<index_t>(std::clamp(fit, 4096.0, 4e6));
  }

  void keep(index_t t, const point_cloud<S, D>& points) {
    survey_file<D> file;
    file.path = folder_ / name_of_tile(t);
    describe_points(points, survey_.edge, file);
    if (!points.empty()) {
      write_cloud(points, file.path);
      file.bytes = fs::file_size(file.path);
    }
    notes_->add(file);
    const std::scoped_lock lock{mutex_};
    own_ += text_of(file);
    files_[file.path.filename().string()] = std::move(file);
  }

  void finish() {
    for (const auto& text : gather_texts(ranks_, own_))
      for (auto& file : files_of_text<D>(text, folder_))
        files_[file.path.filename().string()] = std::move(file);
    on_first_rank(ranks_, [&] {
      tile_index<D> index{
          std::same_as<S, float> ? "float" : "double", survey_.edge, survey_.origin, {}};
      for (index_t t = 0; t < std::ssize(survey_.tiles); ++t)
        if (auto& file = files_[name_of_tile(t)]; file.points > 0)
          index.files.push_back(std::move(file));
      write_index(folder_, index);
      remove_notes(folder_);
      remove_parts(folder_);
    });
  }

  const tile_survey<D>& survey_;
  std::span<const tile_step<S, D>> steps_;
  const process_group* ranks_;
  fs::path folder_;
  const write_tiles_options& options_;
  const task_monitor& monitor_;
  std::optional<tile_notes<D>> notes_;
  std::mutex mutex_;
  std::map<std::string, survey_file<D>> files_;  ///< Those that are done, by name.
  std::string own_;                              ///< Those that this rank has done now, as text.
};

}  // namespace

template <Scalar S, int D>
tiled_cloud<S, D> write_tiles(const tiled_cloud<S, D>& cloud, const fs::path& folder,
                              const write_tiles_options& options) {
  expects(options.format == ".ply" || options.format == ".pcd",
          "write_tiles: tiles are written as .ply or .pcd, which keep all digits");
  const auto ranks = cloud.ranks();
  const std::string what = description_of(cloud, options);
  for (const auto& text : gather_texts(ranks.get(), what))
    expects(text == what, "write_tiles: ranks work on different files, or by different steps:\n" +
                              text + "\nand\n" + what);
  const auto& survey = *cloud.survey();
  const tile_options how{.memory = survey.memory, .threads = survey.threads};
  on_first_rank(ranks.get(), [&] { make_folder(folder, options.resume); });

  const auto measuring =
      std::ranges::count_if(cloud.steps(), [](const auto& step) { return bool(step.measure); });
  const auto monitor = in_passes(options.monitor, static_cast<int>(2 * measuring + 1));
  // What a step measures is written down with the points, and kept by in the pass after it.
  auto from = cloud;
  std::vector<fs::path> passes;
  while (true) {
    auto rest = from.steps();
    const auto next =
        std::ranges::find_if(rest, [](const auto& step) { return bool(step.measure); });
    if (next == rest.end()) break;
    std::vector<tile_step<S, D>> before{rest.begin(), next};
    before.push_back(noting(*next));
    const auto pass = folder / ("pass-" + std::to_string(passes.size() + 1));
    passes.push_back(pass);
    on_first_rank(ranks.get(), [&] {
      // Until there is something in it, that is how the folder is seen to be unfinished.
      const tile_notes<D> begun{folder, what, 0};
      fs::create_directories(pass);
    });
    std::error_code error;
    if (!fs::exists(pass / index_name, error))
      tile_writer<S, D>{{from.survey(), std::move(before), ranks}, pass, what, options, monitor}
          .write();
    const auto written = open_tiles<S, D>(pass, how);
    const tiled_cloud<S, D> noted{written.survey(), {}, ranks};
    std::vector<tile_step<S, D>> after{
        keeping_noted(*next, next->limit(noted_statistics(noted, monitor)))};
    after.insert(after.end(), next + 1, rest.end());
    from = {written.survey(), std::move(after), ranks};
  }
  tile_writer<S, D>{from, folder, what, options, monitor}.write();
  on_first_rank(ranks.get(), [&] {
    std::error_code ignored;
    for (const auto& pass : passes) fs::remove_all(pass, ignored);
  });
  const auto written = open_tiles<S, D>(folder, how);
  return {written.survey(), {}, ranks};
}

#define CILANTRO_INSTANTIATE(S, D)                                                  \
  template tiled_cloud<S, D> write_tiles(const tiled_cloud<S, D>&, const fs::path&, \
                                         const write_tiles_options&);
CILANTRO_INSTANTIATE(float, 2)
CILANTRO_INSTANTIATE(float, 3)
CILANTRO_INSTANTIATE(double, 2)
CILANTRO_INSTANTIATE(double, 3)
#undef CILANTRO_INSTANTIATE

}  // namespace cilantro
