// SPDX-License-Identifier: MIT
module;
#include <cerrno>
module cilantro.io;

import :cloud_source;
import :file_scope;

namespace cilantro {
namespace {

constexpr index_t points_at_a_time = 1 << 16;

/// A source that guesses from the beginning of its file, also if reading begins elsewhere.
template <Scalar S, int D>
class guessing_source : public cloud_source<S, D> {
 public:
  explicit guessing_source(source_pointer<S, D> source) : source_{std::move(source)} {}

  [[nodiscard]] std::optional<std::uint64_t> size() const override { return source_->size(); }
  point_cloud<S, D> read(index_t count) override {
    has_begun_ = true;
    if (first_) {
      auto piece = first_->read(count);
      if (!piece.empty()) {
        if (const auto& origin = this->agreement().origin) change_origin(piece, *origin);
        return piece;
      }
      first_.reset();
    }
    return read_on(count);
  }
  bool seek(std::uint64_t first) override {
    if (!has_begun_) first_.emplace(read_on(points_at_a_time));
    has_begun_ = true;
    if (!source_->seek(first)) return false;
    first_.reset();
    return true;
  }

 private:
  point_cloud<S, D> read_on(index_t count) {
    if (const auto& origin = this->agreement().origin) source_->set_origin(*origin);
    return source_->read(count);
  }

  source_pointer<S, D> source_;
  bool has_begun_ = false;
  std::optional<whole_source<S, D>> first_;  ///< What was read to guess, and not given yet.
};

template <Scalar S, int D>
source_pointer<S, D> open_to_guess(const std::filesystem::path& path, const read_options& options) {
  auto source = open_source<S, D>(path, options);
  if (!source->guesses()) return source;
  return std::make_unique<guessing_source<S, D>>(std::move(source));
}

}  // namespace

template <Scalar S, int D>
  requires(D == 2 || D == 3)
cloud_reader<S, D>::cloud_reader(std::filesystem::path path, const read_options& options)
    : path_{std::move(path)}, options_{options}, source_{open_to_guess<S, D>(path_, options)} {}

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
  if (with_file(path_, [&] { return source_->seek(first); })) {
    next_ = first;
    return;
  }
  if (first < next_) {
    source_ = open_to_guess<S, D>(path_, options_);
    if (origin_) source_->set_origin(*origin_);
    with_file(path_, [&] { return source_->seek(0); });
    next_ = 0;
  }
  while (next_ < first) {
    const std::uint64_t left = first - next_;
    if (read(static_cast<index_t>(std::min<std::uint64_t>(left, points_at_a_time))).empty()) return;
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
