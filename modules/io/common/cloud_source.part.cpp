// SPDX-License-Identifier: MIT
//
// A file that is read in pieces, whatever its format. Internal: shared by the readers.
module cilantro.io:cloud_source;

import cilantro.standard;
import cilantro.core;
import cilantro.cloud;
import :cloud_builder;
import :file_options;

namespace cilantro {

/// The points of a file, from front to back. Members throw what is thrown where a file is read,
/// such as `detail::failure`.
template <Scalar S, int D>
class cloud_source {
 public:
  cloud_source() = default;
  cloud_source(const cloud_source&) = delete;
  cloud_source& operator=(const cloud_source&) = delete;
  virtual ~cloud_source() = default;

  /// How many points there are, if that is known before all are read.
  [[nodiscard]] virtual std::optional<std::uint64_t> size() const = 0;
  /// The next points, up to `count` of them, and none only at the end; relative to `origin`, or to
  /// what the file says if there is none.
  virtual point_cloud<S, D> read(index_t count) = 0;
  /// Makes point `first`, which may be the end, the next one. Sources that cannot, say so.
  virtual bool seek(std::uint64_t first) {
    (void)first;
    return false;
  }

  /// Whether the first piece that is read decides something about all others.
  [[nodiscard]] virtual bool guesses() const { return false; }

  /// Makes this the origin of all pieces from now on.
  void set_origin(const point_vector<double, D>& origin) { agreement_.origin = origin; }

 protected:
  [[nodiscard]] piece_agreement<D>& agreement() { return agreement_; }

 private:
  piece_agreement<D> agreement_;
};

/// What an origin that was chosen for a whole cloud, or 0, becomes if another one is given.
template <Scalar S, int D>
void change_origin(point_cloud<S, D>& cloud, const point_vector<double, D>& origin) {
  const point_vector<double, D> shift = cloud.full_origin() - origin;
  if (!shift.isZero(0))
    cloud.points = (cloud.points.template cast<double>().colwise() + shift).template cast<S>();
  cloud.origin = origin;
}

/// A file of a format that has to be read as a whole, as pieces of it.
template <Scalar S, int D>
class whole_source : public cloud_source<S, D> {
 public:
  explicit whole_source(point_cloud<S, D> all) : all_{std::move(all)} {}

  [[nodiscard]] std::optional<std::uint64_t> size() const override {
    return static_cast<std::uint64_t>(all_.size());
  }
  point_cloud<S, D> read(index_t count) override {
    const index_t n = std::min(count, all_.size() - next_);
    index_list chosen(static_cast<std::size_t>(n));
    for (index_t i = 0; i < n; ++i) chosen[i] = static_cast<std::int32_t>(next_ + i);
    next_ += n;
    auto piece = select(all_, chosen);
    if (const auto& origin = this->agreement().origin) change_origin(piece, *origin);
    return piece;
  }
  bool seek(std::uint64_t first) override {
    next_ = static_cast<index_t>(std::min<std::uint64_t>(first, all_.size()));
    return true;
  }

 private:
  point_cloud<S, D> all_;
  index_t next_ = 0;
};

template <Scalar S, int D>
using source_pointer = std::unique_ptr<cloud_source<S, D>>;

/// One for each format. `origin` and `monitor` of the options act as where a whole file is read.
template <Scalar S, int D>
source_pointer<S, D> open_ply(const std::filesystem::path& path, const read_options& options);
template <Scalar S, int D>
source_pointer<S, D> open_pcd(const std::filesystem::path& path, const read_options& options);
template <Scalar S, int D>
source_pointer<S, D> open_text(const std::filesystem::path& path, const read_options& options);
template <Scalar S, int D>
source_pointer<S, D> open_las(const std::filesystem::path& path, const read_options& options);
/// Of the format that the extension says.
template <Scalar S, int D>
source_pointer<S, D> open_source(const std::filesystem::path& path, const read_options& options);

}  // namespace cilantro
