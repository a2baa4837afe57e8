// SPDX-License-Identifier: MIT
module;
#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <system_error>
#include <utility>
module cilantro.io;

import :cloud_source;
import :file_scope;

namespace cilantro {

template <Scalar S, int D>
  requires(D == 2 || D == 3)
cloud_reader<S, D>::cloud_reader(std::filesystem::path path, const read_options& options)
    : path_{std::move(path)}, options_{options}, source_{open_source<S, D>(path_, options)} {}

template <Scalar S, int D>
  requires(D == 2 || D == 3)
cloud_reader<S, D>::cloud_reader(cloud_reader&&) noexcept = default;
template <Scalar S, int D>
  requires(D == 2 || D == 3)
cloud_reader<S, D>& cloud_reader<S, D>::operator=(cloud_reader&&) noexcept = default;
template <Scalar S, int D>
  requires(D == 2 || D == 3)
cloud_reader<S, D>::~cloud_reader() = default;

template <Scalar S, int D>
  requires(D == 2 || D == 3)
point_cloud<S, D> cloud_reader<S, D>::read(index_t count) {
  expects(count > 0, "cloud_reader: a piece must have at least one point");
  expects(count <= std::numeric_limits<std::int32_t>::max(),
          "cloud_reader: a piece can have 2^31 - 1 points at most");
  auto piece = with_file(path_, [&] { return source_->read(count); });
  next_ += static_cast<std::uint64_t>(piece.size());
  if (!piece.empty() && !origin_) set_origin(piece.full_origin());
  piece.width = piece.height = 0;
  return piece;
}

template <Scalar S, int D>
  requires(D == 2 || D == 3)
std::optional<std::uint64_t> cloud_reader<S, D>::size() const {
  return source_->size();
}

template <Scalar S, int D>
  requires(D == 2 || D == 3)
void cloud_reader<S, D>::seek(std::uint64_t first) {
  constexpr index_t at_a_time = 1 << 16;
  if (with_file(path_, [&] { return source_->seek(first); })) {
    next_ = first;
    return;
  }
  if (first < next_) {
    source_ = open_source<S, D>(path_, options_);
    if (origin_) source_->set_origin(*origin_);
    next_ = 0;
  }
  while (next_ < first) {
    const std::uint64_t left = first - next_;
    if (read(static_cast<index_t>(std::min<std::uint64_t>(left, at_a_time))).empty()) return;
  }
}

template <Scalar S, int D>
  requires(D == 2 || D == 3)
void cloud_reader<S, D>::set_origin(const point_vector<double, D>& origin) {
  expects(is_finite(origin), "cloud_reader: the origin must be finite");
  origin_ = origin;
  source_->set_origin(origin);
}

template class cloud_reader<float, 2>;
template class cloud_reader<float, 3>;
template class cloud_reader<double, 2>;
template class cloud_reader<double, 3>;

}  // namespace cilantro
