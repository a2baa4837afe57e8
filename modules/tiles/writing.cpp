// SPDX-License-Identifier: MIT
module cilantro.tiles;

import cilantro.eigen;
import cilantro.geometry;
import :communicator;
import :index_file;
import :limits;
import :places;
import :ranks;
import :reduce_tiles;
import :running;
import :survey;
import :tile_writer;
import :work_folder;

namespace cilantro {
namespace {

namespace fs = std::filesystem;

/// Whether points that are written down by tile after the first step that measures, without their
/// places, would be others after the steps behind it: where these look around, the order decides
/// which of equally near points they take, and how sums are rounded.
template <Scalar S, int D>
bool order_decides(const tiled_cloud<S, D>& cloud) {
  const std::span steps{cloud.steps()};
  const auto next = std::ranges::find_if(steps, is_measuring<S, D>);
  if (first_with_places(*cloud.survey(), steps.first(std::size_t(next - steps.begin()))))
    return false;
  return std::any_of(next + 1, steps.end(), [](const tile_step<S, D>& step) {
    return step.reach != step_reach{} && !step.measure;
  });
}

}  // namespace

template <Scalar S, int D>
std::string description_of(const tiled_cloud<S, D>& cloud, const write_tiles_options& options) {
  const auto& survey = *cloud.survey();
  std::string line = "cilantro tiles 1, of " + description_of(survey.files) + ", edge " +
                     in_digits(survey.edge) + ", " + (std::same_as<S, float> ? "float" : "double") +
                     ", to " + options.format + ", steps:" + description_of(cloud.steps());
  std::ranges::replace_if(line, [](char c) { return c == '\n' || c == '\r'; }, ' ');
  return line;
}

void expect_same(const process_group* ranks, const std::string& what) {
  for (auto& text : gather_texts(ranks, what))
    if (text != what)
      throw invalid_input{"write_tiles: ranks work on different files, or by different steps:\n" +
                          text.append("\nand\n").append(what)};
}

template <Scalar S, int D>
tiled_cloud<S, D> write_tiles_as(const tiled_cloud<S, D>& cloud, const fs::path& folder,
                                 bool is_local, const write_tiles_options& options) {
  expects(options.format == ".ply" || options.format == ".pcd",
          "write_tiles: tiles are written as .ply or .pcd, which keep all digits");
  const auto& ranks = cloud.ranks();
  const std::string what = description_of(cloud, options);
  expect_same(ranks.get(), what);
  const auto& survey = *cloud.survey();
  const tile_options how{.memory = survey.memory, .threads = survey.threads};
  if (options.resume && is_complete<D>(ranks.get(), folder, what))
    return opened_by_all<S, D>(folder, how, ranks);
  std::unique_ptr<folder_lock> lock;
  on_first_rank(ranks.get(), [&] { lock = make_folder(folder, options.resume); });

  const auto measuring = std::ranges::count_if(cloud.steps(), is_measuring<S, D>);
  const auto monitor = in_passes(options.monitor, static_cast<int>(2 * measuring + 1));
  auto from = cloud;
  std::size_t passes = 0;
  while (std::ranges::any_of(from.steps(), is_measuring<S, D>)) {
    if (order_decides(from)) {
      from = {from.survey(), with_first_limit(from, monitor), ranks};
      continue;
    }
    // What the step measures is written down with the points, and kept by in the pass after it.
    const auto& steps = from.steps();
    const auto next = std::ranges::find_if(steps, is_measuring<S, D>);
    std::vector<tile_step<S, D>> before{steps.begin(), next};
    before.push_back(noting(*next));
    const auto pass = pass_folder(folder, ++passes);
    on_first_rank(ranks.get(), [&] {
      // Until there is something in it, that is how the folder is seen to be unfinished.
      const tile_notes<D> begun{folder, what, 0};
      std::error_code failure;
      fs::create_directories(pass, failure);
      if (failure) throw io_error{pass, "cannot be made: " + failure.message()};
    });
    const auto noting_what = what + ", put aside with what " + next->name + " measures";
    std::optional<distance_statistics> all;
    if (!is_complete<D>(ranks.get(), pass, noting_what)) {
      const double border = likely_border<S, D>(*from.survey(), steps, before.size());
      const tiled_cloud<S, D> to_note{from.survey(), std::move(before), ranks};
      tile_writer<S, D> writer{to_note, pass, noting_what, true, options, monitor, border};
      std::vector<distance_statistics> sums(1);
      std::mutex mutex;
      writer.write({}, [&](const point_cloud<S, D>& tile) {
        const auto found = noted_statistics(tile);
        const std::scoped_lock lock_of_sum{mutex};
        sums.front() += found;
      });
      if (!writer.has_begun()) {
        add_up_over_ranks(ranks.get(), sums);
        all = sums.front();
        on_all_ranks(ranks.get(), [&] {
          if (monitor.progress) monitor.progress(1);
        });
      }
    }
    const auto noted = opened_by_all<S, D>(pass, how, ranks);
    if (!all) all = noted_statistics(noted, monitor);
    std::vector<tile_step<S, D>> after{keeping_noted(*next, next->limit(*all))};
    after.insert(after.end(), next + 1, steps.end());
    from = {noted.survey(), std::move(after), ranks};
  }
  tile_writer<S, D>{from, folder, what, is_local, options, monitor}.write();
  on_first_rank(ranks.get(), [&] { remove_leftovers(folder); });
  return opened_by_all<S, D>(folder, how, ranks);
}

template <Scalar S, int D>
tiled_cloud<S, D> write_tiles(const tiled_cloud<S, D>& cloud, const fs::path& folder,
                              const write_tiles_options& options) {
  return write_tiles_as(cloud, folder, false, options);
}

#define CILANTRO_INSTANTIATE(S, D)                                                           \
  template std::string description_of(const tiled_cloud<S, D>&, const write_tiles_options&); \
  template tiled_cloud<S, D> write_tiles_as(const tiled_cloud<S, D>&, const fs::path&, bool, \
                                            const write_tiles_options&);                     \
  template tiled_cloud<S, D> write_tiles(const tiled_cloud<S, D>&, const fs::path&,          \
                                         const write_tiles_options&);
CILANTRO_INSTANTIATE(float, 2)
CILANTRO_INSTANTIATE(float, 3)
CILANTRO_INSTANTIATE(double, 2)
CILANTRO_INSTANTIATE(double, 3)
#undef CILANTRO_INSTANTIATE

}  // namespace cilantro
