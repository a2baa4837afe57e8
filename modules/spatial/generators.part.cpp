// SPDX-License-Identifier: MIT
//
// What generates sets with flat sides, and which of it lies on which plane.
module cilantro.spatial:generators;

import cilantro.standard;
import cilantro.core;
import cilantro.eigen;
import :polytope_data;
import :polytope_shape;

namespace cilantro {

/// The corners and rays of a convex set, its lines, its planes, and the planes that each corner and
/// ray lies on.
///
/// Corners and rays are `generators` (x, w) with w = 1 or 0. Plane 0 is the one at infinity, which
/// holds the rays; the others begin at 1. Lines lie in all planes; of what is the same along them,
/// there is one generator each. What is called for each of them is `inline`, so that cutting, which
/// is another unit, has it at hand.
class generator_lists {
 public:
  /// Rays and lines that come nearer to a plane than this lie in it: normals are not more certain.
  static constexpr double negligible_slope = 1e-12;
  /// In tolerances, how far apart the same corner may be found from planes that are nearly
  /// parallel.
  static constexpr double nearby = 256;
  /// On which sides of a plane normal · x = offset there is more than the tolerance.
  struct sides {
    bool inner = false, outer = false;
  };

  /// Coordinates of a point.
  [[nodiscard]] inline index_t dimension() const { return d_; }
  /// Whether it is known which planes generators lie on, and thereby which ones are neighbours.
  [[nodiscard]] inline bool has_edges() const { return !on_.empty(); }
  /// The number of corners and rays, and (x, w) of one of them.
  [[nodiscard]] inline index_t size() const { return count_; }
  [[nodiscard]] inline const double* generator(index_t g) const {
    return &generators_[g * (d_ + 1)];
  }
  [[nodiscard]] inline bool is_ray(index_t g) const { return generator(g)[d_] == 0; }
  /// The planes that a generator lies on, a bit each, and their number.
  [[nodiscard]] inline std::span<const std::uint64_t> planes_of(index_t g) const {
    return {&on_[g * words_], static_cast<std::size_t>(words_)};
  }
  [[nodiscard]] inline int plane_count_of(index_t g) const { return count_bits(planes_of(g)); }
  [[nodiscard]] inline bool lies_on(index_t g, index_t plane) const {
    return (on_[g * words_ + plane / 64] >> (plane % 64) & 1) != 0;
  }
  /// Orthonormal directions, one per column.
  [[nodiscard]] inline const Eigen::MatrixXd& lines() const { return lines_; }
  /// All planes but that at infinity, normal and offset a column, of which some may say nothing
  /// new.
  [[nodiscard]] Eigen::Map<const Eigen::MatrixXd> planes() const {
    return {planes_.data(), d_ + 1, plane_count()};
  }
  inline void add_plane(const double* normal, double offset, double sign) {
    for (index_t k = 0; k < d_; ++k) planes_.push_back(sign * normal[k]);
    planes_.push_back(sign * offset);
  }

  [[nodiscard]] sides beside(const double* normal, double offset, double tolerance) const {
    if (crosses_lines(normal)) return {.inner = true, .outer = true};
    const bool uniform = is_uniform(tolerance);
    sides found;
    const double* x = generators_.data();
    for (index_t g = 0; g < count_; ++g, x += d_ + 1) {
      double height = -offset * x[d_];
      for (index_t k = 0; k < d_; ++k) height += normal[k] * x[k];
      const double negligible = uniform ? tolerance : tolerance_at(x, tolerance);
      found.inner |= height < -negligible;
      found.outer |= height > negligible;
    }
    return found;
  }
  /// How far from its planes a generator may be: corners that are farther away than those that have
  /// this tolerance are nearly rays.
  [[nodiscard]] inline double tolerance_at(const double* x, double tolerance) const {
    if (x[d_] == 0) return negligible_slope;
    double size = 0;
    for (index_t k = 0; k < d_; ++k) size = std::max(size, std::abs(x[k]));
    return rounding * size <= tolerance ? tolerance : negligible_slope * size;
  }

 protected:
  static constexpr double rounding = 64 * std::numeric_limits<double>::epsilon();
  static constexpr index_t most_words = index_t{1} << 20;

  static inline int count_bits(std::span<const std::uint64_t> bits) {
    int sum = 0;
    for (const auto word : bits) sum += std::popcount(word);
    return sum;
  }
  static inline index_t words_for(index_t planes) { return (planes + 63) / 64; }
  [[nodiscard]] inline index_t plane_count() const { return std::ssize(planes_) / (d_ + 1); }
  [[nodiscard]] inline double* generator(index_t g) { return &generators_[g * (d_ + 1)]; }
  /// Whether all generators have the tolerance itself.
  [[nodiscard]] inline bool is_uniform(double tolerance) const {
    return rounding * reach_ <= tolerance;
  }
  [[nodiscard]] inline double height_of(index_t g, const double* normal, double offset) const {
    const double* x = generator(g);
    double sum = -offset * x[d_];
    for (index_t k = 0; k < d_; ++k) sum += normal[k] * x[k];
    return sum;
  }
  [[nodiscard]] Eigen::VectorXd slope_of_lines(const double* normal) const {
    return lines_.transpose() * Eigen::VectorXd::Map(normal, d_);
  }
  [[nodiscard]] inline bool crosses_lines(const double* normal) const {
    return lines_.cols() > 0 && slope_of_lines(normal).norm() > negligible_slope;
  }

  inline void mark(index_t g, index_t plane) {
    on_[g * words_ + plane / 64] |= std::uint64_t{1} << (plane % 64);
  }
  inline void add_generator(const double* x, std::span<const std::uint64_t> planes, bool is_on,
                            index_t plane) {
    generators_.insert(generators_.end(), x, x + d_ + 1);
    on_.insert(on_.end(), planes.begin(), planes.end());
    on_.resize((count_ + 1) * words_, 0);
    if (is_on) mark(count_, plane);
    ++count_;
  }

  /// All of space: one corner, and lines.
  void start_everywhere(index_t dimension) {
    d_ = dimension;
    generators_.assign(d_ + 1, 0);
    generators_[d_] = 1;
    count_ = words_ = 1;
    on_.assign(1, 0);
    lines_ = Eigen::MatrixXd::Identity(d_, d_);
    reach_ = std::numeric_limits<double>::infinity();
  }
  void start_without_edges(const polytope_data& p) {
    d_ = p.dimension;
    const index_t corners = p.vertices.cols();
    count_ = corners + p.rays.cols();
    reach_ = p.bounded ? p.vertices.cwiseAbs().maxCoeff() : std::numeric_limits<double>::infinity();
    generators_.resize(count_ * (d_ + 1));
    for (index_t g = 0; g < count_; ++g) {
      const bool is_corner = g < corners;
      Eigen::VectorXd::Map(generator(g), d_) =
          is_corner ? p.vertices.col(g) : p.rays.col(g - corners);
      generator(g)[d_] = is_corner ? 1 : 0;
    }
    planes_.reserve(p.facets.size() * (d_ + 1));
    for (index_t f = 0; f < p.facets.size(); ++f)
      add_plane(p.normals.col(f).data(), p.offsets[f], 1);
  }
  /// False where a corner of a bounded polytope is short of facets, so that its edges are not
  /// known.
  [[nodiscard]] bool start_from_corners(const polytope_data& p) {
    start_without_edges(p);
    words_ = words_for(plane_count() + 1);
    on_.assign(count_ * words_, 0);
    for (index_t f = 0; f < p.facets.size(); ++f)
      for (const auto g : p.facets[f]) mark(g, f + 1);
    for (index_t g = 0; g < count_; ++g)
      if (plane_count_of(g) < d_) return false;
    return true;
  }
  /// Those planes and lines, and another plane.
  void start_from_planes(const generator_lists& other, const double* normal, double offset,
                         double sign) {
    d_ = other.d_;
    planes_.reserve(other.planes_.size() + d_ + 1);
    planes_ = other.planes_;
    add_plane(normal, offset, sign);
    words_ = words_for(plane_count() + 1);
    generators_.reserve(other.generators_.size());
    on_.reserve(other.count_ * words_);
    lines_ = other.lines_;
    reach_ = other.reach_;
  }

  /// Moves a generator onto its planes: what is near is wrong by the rounding of what is far, where
  /// it was found from there.
  void settle(index_t g) {
    const bool ray = is_ray(g);
    auto place = Eigen::VectorXd::Map(generator(g), d_);
    index_list on;
    for (index_t f = 0; f < plane_count(); ++f)
      if (lies_on(g, f + 1)) on.push_back(static_cast<std::int32_t>(f));
    if (on.empty()) return;
    const Eigen::MatrixXd meeting = columns_of(planes(), on);
    const auto normals = meeting.topRows(d_);
    const auto errors = [&](const Eigen::VectorXd& at) -> Eigen::VectorXd {
      const Eigen::VectorXd heights = normals.transpose() * at;
      return ray ? heights : Eigen::VectorXd{heights - meeting.row(d_).transpose()};
    };
    const Eigen::VectorXd wrong = errors(place);
    const double size =
        ray ? 1 : std::max(place.cwiseAbs().maxCoeff(), meeting.row(d_).cwiseAbs().maxCoeff());
    const double most = wrong.cwiseAbs().maxCoeff();
    if (most <= 4 * std::numeric_limits<double>::epsilon() * size) return;
    // Not along planes that are nearly parallel, where it would go far.
    const Eigen::MatrixXd across = span_of(normals, 1e-6);
    const auto step = solve_least_squares(normals.transpose() * across, wrong);
    Eigen::VectorXd settled = place - across * step.unknowns.col(0);
    if (ray) settled.normalize();
    if (errors(settled).cwiseAbs().maxCoeff() < most) place = settled;
  }

  index_t d_ = 0, count_ = 0, words_ = 0;
  std::vector<double> planes_;  ///< d + 1 numbers each: normal and offset.
  std::vector<double> generators_;
  std::vector<std::uint64_t> on_;  ///< Empty if it is not known.
  Eigen::MatrixXd lines_ = {};
  double reach_ = 0;  ///< No coordinate of a corner is larger; infinity where there may be rays.
};

}  // namespace cilantro
