// SPDX-License-Identifier: MIT
//
// All tiles of a cloud into one folder. Internal.
module cilantro.tiles:tile_writer;

import cilantro.standard;
import cilantro.eigen;
import cilantro.core;
import cilantro.cloud;
import cilantro.io;
import :communicator;
import :cutting;
import :index_file;
import :places;
import :ranks;
import :running;
import :survey;
import :tile_step;
import :tiled_cloud;
import :work_folder;
import :write_tiles;

namespace cilantro {

/// A line that tells whether a folder was begun with the same input, steps and options.
template <Scalar S, int D>
std::string description_of(const tiled_cloud<S, D>& cloud, const write_tiles_options& options);

/// `write_tiles`; if `is_local`, points are put aside for another pass, and keep all digits and,
/// if they are known, their places.
template <Scalar S, int D>
tiled_cloud<S, D> write_tiles_as(const tiled_cloud<S, D>& cloud,
                                 const std::filesystem::path& folder, bool is_local,
                                 const write_tiles_options& options);

/// Throws `invalid_input` unless all ranks say the same.
void expect_same(const process_group* ranks, const std::string& what);

/// What has been written, opened by each rank: a file system may show it to one later than to
/// others.
template <Scalar S, int D>
tiled_cloud<S, D> opened_by_all(const std::filesystem::path& folder, const tile_options& how,
                                const std::shared_ptr<const process_group>& ranks) {
  std::optional<tiled_cloud<S, D>> opened;
  on_all_ranks(ranks.get(), [&] { opened = open_tiles<S, D>(folder, how); });
  return {opened->survey(), {}, ranks};
}

/// All tiles of a cloud, none of whose steps measures, into one folder.
template <Scalar S, int D>
class tile_writer {
 public:
  /// Of points that are put aside, other tiles will read those up to `border` away from a side. The
  /// cloud must live as long as this.
  tile_writer(const tiled_cloud<S, D>& cloud, const std::filesystem::path& folder,
              const std::string& what, bool is_local, const write_tiles_options& options,
              const task_monitor& monitor, double border = 0)
      : survey_{*cloud.survey()},
        steps_{cloud.steps()},
        ranks_{cloud.ranks().get()},
        folder_{folder},
        what_{what},
        is_local_{is_local},
        options_{options},
        monitor_{monitor},
        border_{border} {
    on_all_ranks(ranks_, [&] {
      for (auto& file : read_notes<D>(folder, what)) {
        std::error_code error;
        // Without points there is no file.
        if (file.points > 0 &&
            (std::filesystem::file_size(file.path, error) != file.bytes || error))
          continue;
        files_[file.path.filename().string()] = std::move(file);
      }
    });
    // What has been written may be seen by one rank later than by others.
    has_begun_ = !gather_texts(ranks_, files_.empty() ? "" : "begun").front().empty();
    on_first_rank(ranks_, [&] { remove_files(folder, part_ending); });
    on_all_ranks(ranks_, [&] { notes_.emplace(folder, what, ranks_ ? ranks_->rank : 0); });
  }

  /// Whether some tiles are there already, of a run that goes on.
  [[nodiscard]] bool has_begun() const { return has_begun_; }

  /// Writes all tiles that are not there yet, by `make` if it is given: the points of tile number
  /// t. `look` is shown each of them, by several threads at once.
  void write(const std::function<point_cloud<S, D>(index_t)>& make = {},
             const std::function<void(const point_cloud<S, D>&)>& look = {}) {
    std::vector<index_t> left;
    std::map<tile_key, index_t> wanted;
    for (index_t t = 0; t < std::ssize(survey_.tiles); ++t)
      if (!files_.contains(name_of_tile(t))) {
        left.push_back(t);
        wanted[{survey_.tiles[t].x, survey_.tiles[t].y}] = t;
      }
    std::unique_ptr<tile_cutter<S, D>> cutter;
    const bool cuts = steps_.empty() && !make;
    const auto monitor = cuts ? in_passes(monitor_, 2) : monitor_;
    if (cuts && !left.empty())
      cutter = std::make_unique<tile_cutter<S, D>>(survey_, ranks_, wanted, folder_,
                                                   points_at_a_time(), monitor);
    on_all_ranks(ranks_, [&] {
      run_all<D>(
          survey_, ranks_, left, survey_.threads,
          [&](index_t t) { return memory_of<S, D>(survey_, steps_, survey_.tiles[t], 0); },
          [&](index_t t) {
            auto points = make ? make(t)
                          : cutter
                              ? cutter->tile(t)
                              : run_tile<S, D>(survey_, steps_, survey_.tiles[t], 0, monitor_.stop,
                                               is_local_ ? place_notes::kept : place_notes::none);
            if (look) look(points);
            keep(t, std::move(points));
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

  void keep(index_t t, point_cloud<S, D> points) {
    if (!points.empty()) expect_as_before(parts_of(points));
    survey_file<D> file;
    file.path = folder_ / name_of_tile(t);
    if (is_local_) {
      put_aside(points);
      describe_parts(points, sort_by_border(points, survey_.tiles[t], survey_.edge, border_), file);
      points.origin.setZero();
    } else {
      describe_points(points, survey_.edge, false, file);
    }
    if (!points.empty()) {
      write_cloud(points, file.path);
      std::error_code error;
      file.bytes = std::filesystem::file_size(file.path, error);
      if (error) throw io_error{file.path, "was written, and is gone: " + error.message()};
    }
    notes_->add(file);
    const std::scoped_lock lock{mutex_};
    own_ += text_of(file);
    files_[file.path.filename().string()] = std::move(file);
  }

  /// Readers of the tiles expect of all what one of them has.
  void expect_as_before(point_parts parts) {
    const std::scoped_lock lock{mutex_};
    if (!parts_)
      parts_ = std::move(parts);
    else
      expects(parts_->normals == parts.normals && parts_->colors == parts.colors &&
                  parts_->attributes == parts.attributes,
              "write_tiles: the steps give some tiles other attributes, normals or colours than "
              "others: all must have the same");
  }

  /// As `describe_points`, with no run in two parts.
  void describe_parts(const point_cloud<S, D>& points, std::span<const index_t> ends,
                      survey_file<D>& file) const {
    index_t begin = 0;
    for (const index_t end : ends) {
      const point_cloud<S, D> part{.points = points.points.middleCols(begin, end - begin),
                                   .origin = points.origin};
      describe_points(part, survey_.edge, true, file);
      begin = end;
    }
    file.points = static_cast<std::uint64_t>(points.size());
  }

  void finish() {
    for (const auto& text : gather_texts(ranks_, own_))
      for (auto& file : files_of_text<D>(text, folder_))
        files_[file.path.filename().string()] = std::move(file);
    on_first_rank(ranks_, [&] {
      tile_index<D> index{what_,        is_local_,      std::same_as<S, float> ? "float" : "double",
                          survey_.edge, survey_.origin, {}};
      for (index_t t = 0; t < std::ssize(survey_.tiles); ++t)
        if (auto& file = files_[name_of_tile(t)]; file.points > 0)
          index.files.push_back(std::move(file));
      write_index(folder_, index);
      remove_notes(folder_);
      remove_files(folder_, part_ending);
    });
  }

  const tile_survey<D>& survey_;
  std::span<const tile_step<S, D>> steps_;
  const process_group* ranks_;
  std::filesystem::path folder_;
  std::string what_;
  bool is_local_;
  const write_tiles_options& options_;
  const task_monitor& monitor_;
  double border_;
  bool has_begun_ = false;
  std::optional<tile_notes<D>> notes_;
  std::mutex mutex_;
  std::optional<point_parts> parts_;             ///< What the tiles of this run have.
  std::map<std::string, survey_file<D>> files_;  ///< Those that are done, by name.
  std::string own_;                              ///< Those that this rank has done now, as text.
};

}  // namespace cilantro
