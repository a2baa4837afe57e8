// SPDX-License-Identifier: MIT
module;
#include <fcntl.h>
#include <unistd.h>
#include <cerrno>
module cilantro.tiles;

import cilantro.eigen;
import :communicator;
import :cutting;
import :ranks;
import :survey;

namespace cilantro {
namespace {

[[noreturn]] void fail(const std::filesystem::path& folder, const char* what) {
  throw io_error{
      folder, std::string{what} + ": " + std::error_code{errno, std::generic_category()}.message()};
}

}  // namespace

scratch_file::scratch_file(const std::filesystem::path& path, bool is_new)
    : path_{path},
      descriptor_{::open(path.c_str(), (is_new ? O_RDWR | O_CREAT | O_TRUNC : O_RDONLY) | O_CLOEXEC,
                         0666)} {
  if (descriptor_ < 0) fail(path_, "points cannot be put aside here");
}

scratch_file::~scratch_file() {
  ::close(descriptor_);
}

void scratch_file::append(const void* data, std::size_t bytes) {
  const char* from = static_cast<const char*>(data);
  while (bytes > 0) {
    const auto put = ::pwrite(descriptor_, from, bytes, static_cast<off_t>(size_));
    if (put < 0 && errno == EINTR) continue;
    if (put <= 0) fail(path_, "points cannot be put aside here");
    from += put;
    bytes -= static_cast<std::size_t>(put);
    size_ += static_cast<std::uint64_t>(put);
  }
}

void scratch_file::read(std::uint64_t at, void* data, std::size_t bytes) const {
  char* to = static_cast<char*>(data);
  while (bytes > 0) {
    const auto got = ::pread(descriptor_, to, bytes, static_cast<off_t>(at));
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) fail(path_, "points that were put aside here cannot be read");
    to += got;
    bytes -= static_cast<std::size_t>(got);
    at += static_cast<std::uint64_t>(got);
  }
}

template <Scalar S, int D>
tile_cutter<S, D>::tile_cutter(const tile_survey<D>& survey, const process_group* ranks,
                               const std::map<tile_key, index_t>& wanted,
                               const std::filesystem::path& folder, index_t piece,
                               const task_monitor& monitor)
    : survey_{survey}, ranks_{ranks}, folder_{folder}, scratch_(ranks ? ranks->size : 1) {
  const int me = ranks ? ranks->rank : 0;
  on_all_ranks(ranks, [&] {
    scratch_[me] = std::make_unique<scratch_file>(scratch_of(me), true);
    try {
      read_files(wanted, piece, monitor);
    } catch (const cancelled&) {
      take_all_tickets(ranks);
      throw;
    }
  });
  share_chunks();
}

template <Scalar S, int D>
tile_cutter<S, D>::~tile_cutter() {
  std::error_code ignored;
  std::filesystem::remove(scratch_of(ranks_ ? ranks_->rank : 0), ignored);
}

template <Scalar S, int D>
std::filesystem::path tile_cutter<S, D>::scratch_of(int rank) const {
  return folder_ / ("points-" + std::to_string(rank) + ".part");
}

template <Scalar S, int D>
void tile_cutter<S, D>::read_files(const std::map<tile_key, index_t>& wanted, index_t piece,
                                   const task_monitor& monitor) {
  if (ranks_ != nullptr) ranks_->deal(std::ssize(survey_.files));
  index_t alone = 0;
  std::uint64_t done = 0;
  for (;;) {
    const auto f = ranks_ != nullptr ? ranks_->next_ticket() : std::optional{alone++};
    if (!f || *f >= std::ssize(survey_.files)) return;
    const auto& file = survey_.files[*f];
    if (file.points == 0) continue;
    expect_unchanged(file);
    cloud_reader<S, D> reader{file.path, {.monitor = {.stop = monitor.stop}}};
    reader.set_origin(survey_.origin);
    reader.seek(0);  // So that what is guessed does not depend on the size of pieces.
    for (auto points = reader.read(piece); !points.empty(); points = reader.read(piece)) {
      if (monitor.stop.stop_requested()) throw cancelled{};
      done += static_cast<std::uint64_t>(points.size());
      conform(points, survey_.parts, file.path);
      keep(points, *f, wanted);
      if (monitor.progress) monitor.progress(std::min(1.0, double(done) / double(survey_.points)));
    }
  }
}

/// Tells all ranks where the others have put what.
template <Scalar S, int D>
void tile_cutter<S, D>::share_chunks() {
  chunks_ = gather_all(ranks_, chunks_);
  // What a rank has put aside of one file is in the order of that file.
  std::ranges::sort(chunks_, {}, [](const chunk& c) { return std::tuple{c.tile, c.file, c.at}; });
  on_all_ranks(ranks_, [&] {
    for (std::size_t r = 0; r < scratch_.size(); ++r)
      if (!scratch_[r])
        scratch_[r] = std::make_unique<scratch_file>(scratch_of(static_cast<int>(r)), false);
  });
}

template <Scalar S, int D>
void tile_cutter<S, D>::keep(const point_cloud<S, D>& piece, index_t file,
                             const std::map<tile_key, index_t>& wanted) {
  const int me = ranks_ ? ranks_->rank : 0;
  auto& scratch = *scratch_[me];
  std::map<index_t, index_list> by_tile;
  index_list* list = nullptr;
  tile_key last;
  for (index_t i = 0; i < piece.size(); ++i) {
    const auto place = world_of<S, D>(piece.points.col(i), survey_.origin);
    if (!is_finite(place)) continue;
    const auto key = key_of(place, survey_.edge);
    if (list == nullptr || key != last) {
      const auto found = wanted.find(key);
      if (found == wanted.end()) continue;
      list = &by_tile[found->second];
      last = key;
    }
    list->push_back(static_cast<std::int32_t>(i));
  }
  for (const auto& [number, indices] : by_tile) {
    auto part = select(piece, indices);
    chunks_.push_back({number, file, scratch.size(), part.size(), me});
    for_each_part(part, [&](const void* data, std::size_t bytes) { scratch.append(data, bytes); });
  }
}

template <Scalar S, int D>
point_cloud<S, D> tile_cutter<S, D>::tile(index_t number) const {
  std::vector<point_cloud<S, D>> parts;
  for (const auto& chunk : std::ranges::equal_range(chunks_, number, {}, &chunk::tile)) {
    auto& part = parts.emplace_back();
    part.points.resize(D, chunk.points);
    if (survey_.parts.normals) part.normals.resize(D, chunk.points);
    if (survey_.parts.colors) part.colors.resize(3, chunk.points);
    for (const auto& [name, type] : survey_.parts.attributes)
      part.attributes.push_back({name, values_of_type(type, chunk.points)});
    std::uint64_t at = chunk.at;
    for_each_part(part, [&](void* data, std::size_t bytes) {
      scratch_[chunk.rank]->read(at, data, bytes);
      at += bytes;
    });
  }
  auto all = append_all(parts);
  all.origin = survey_.origin;
  all.comments = survey_.parts.comments;

  constexpr int parts_of_an_edge = 16;
  const double edge = survey_.edge / parts_of_an_edge;
  std::vector<std::pair<tile_key, std::int32_t>> order;
  order.reserve(all.size());
  for (index_t i = 0; i < all.size(); ++i) {
    auto key = key_of(world_of<S, D>(all.points.col(i), survey_.origin), edge);
    // To and fro, so that a run of points does not jump from one side to the other.
    if (key.x % 2 != 0) key.y = -key.y;
    order.emplace_back(key, static_cast<std::int32_t>(i));
  }
  std::ranges::sort(order);
  index_list indices;
  indices.reserve(all.size());
  for (const auto& [key, i] : order) indices.push_back(i);
  return select(all, indices);
}

template class tile_cutter<float, 2>;
template class tile_cutter<float, 3>;
template class tile_cutter<double, 2>;
template class tile_cutter<double, 3>;

}  // namespace cilantro
