// SPDX-License-Identifier: MIT
module;
#include "core/closed_spaces.hpp"
#include "geometry/kernels/plane_fit.hpp"
module cilantro.geometry;

namespace cilantro {
namespace {

/// The smallest eigenvalue of a symmetric matrix with its eigenvector, the second smallest and the
/// largest one. In two dimensions the last two are the same.
template <int D>
struct least_direction {
  point_vector<double, D> normal;
  double smallest, second, largest;
};

least_direction<2> find_least_direction(const Eigen::Matrix2d& m) {
  const double half_sum = (m(0, 0) + m(1, 1)) / 2, half_difference = (m(0, 0) - m(1, 1)) / 2;
  // Like std::hypot, whose last bit depends on the machine's C library.
  const double a = std::abs(half_difference), b = std::abs(m(0, 1));
  const double larger = std::max(a, b), ratio = std::min(a, b) / larger;
  const double root = larger > 0 ? larger * std::sqrt(1 + ratio * ratio) : 0;
  // Of the two ways to write the eigenvector of the largest eigenvalue, the one without
  // cancellation.
  Eigen::Vector2d along = half_difference >= 0 ? Eigen::Vector2d{half_difference + root, m(0, 1)}
                                               : Eigen::Vector2d{m(0, 1), root - half_difference};
  const double length = along.norm();
  along = length > 0 ? Eigen::Vector2d{along / length} : Eigen::Vector2d{1, 0};
  return {{-along.y(), along.x()}, half_sum - root, half_sum + root, half_sum + root};
}

/// A vector that m − λ sends to nothing: the longest cross product of two of its columns.
Eigen::Vector3d null_vector(Eigen::Matrix3d m, double eigenvalue) {
  m.diagonal().array() -= eigenvalue;
  const Eigen::Vector3d candidates[] = {m.col(0).cross(m.col(1)), m.col(1).cross(m.col(2)),
                                        m.col(2).cross(m.col(0))};
  const Eigen::Vector3d& longest =
      *std::ranges::max_element(candidates, {}, [](const auto& v) { return v.squaredNorm(); });
  const double length = longest.norm();
  return length > 0 ? Eigen::Vector3d{longest / length} : Eigen::Vector3d{Eigen::Vector3d::Zero()};
}

/// Eigenvalues by the trigonometric solution of the cubic (Smith 1961), which is off by up to √ε
/// where the two smaller ones nearly meet; the Rayleigh quotient of the first eigenvector squares
/// that error, and the second eigenvector is good to rounding.
least_direction<3> find_least_direction(const Eigen::Matrix3d& m) {
  const double mean = m.trace() / 3;
  const Eigen::Matrix3d centered = m - mean * Eigen::Matrix3d::Identity();
  const double spread = std::sqrt(centered.squaredNorm() / 6);
  if (!(spread > 0)) return {Eigen::Vector3d::UnitZ(), mean, mean, mean};
  const double half_determinant = std::clamp((centered / spread).determinant() / 2, -1.0, 1.0);
  const double angle = std::acos(half_determinant) / 3;
  const double largest = mean + 2 * spread * std::cos(angle);
  double smallest = mean + 2 * spread * std::cos(angle + 2 * std::numbers::pi / 3);

  Eigen::Vector3d normal = null_vector(m, smallest);
  smallest = normal.dot(m * normal);
  const Eigen::Vector3d refined = null_vector(m, smallest);
  if (!refined.isZero(0)) {
    normal = refined;
    smallest = normal.dot(m * normal);
  }
  return {normal, smallest, 3 * mean - largest - smallest, largest};
}

least_direction<dynamic> find_least_direction(const Eigen::MatrixXd& m) {
  const auto [values, vectors, converged] = decompose_symmetric(m);
  return {vectors.col(0), values[0], values.size() > 1 ? values[1] : values[0],
          values[values.size() - 1]};
}

/// The normal and the curvature of the plane that points with the given scatter (or covariance) lie
/// about. `noise` is the variance that rounding alone can make. Nothing if undetermined.
template <Scalar S, int D>
struct plane {
  point_vector<S, D> normal;
  S curvature = 0;

  static std::optional<plane> of(const Eigen::Matrix<double, D, D>& scatter, double noise) {
    const double total = scatter.trace();
    if (!std::isfinite(total)) return std::nullopt;
    const auto least = find_least_direction(scatter);
    const auto dimension = scatter.rows();
    if (dimension > 1 && !(least.second > double(dimension) * (1e-14 * least.largest + noise)))
      return std::nullopt;
    if (least.normal.isZero(0)) return std::nullopt;
    return plane{least.normal.template cast<S>(),
                 total > 0 ? static_cast<S>(std::max(least.smallest, 0.0) / total) : S(0)};
  }
};

/// Points on a line scatter around it by the rounding of their coordinates, and no less.
template <Scalar S>
double rounding_of(double largest_coordinate, double extent) {
  return std::numeric_limits<S>::epsilon() * (largest_coordinate + extent);
}

/// Fits the plane of least squares through a neighbourhood.
template <Scalar S, int D>
class least_squares_fit {
 public:
  explicit least_squares_fit(points_view<S, D> points)
      : points_{points},
        mean_(points.dimension()),
        scatter_(points.dimension(), points.dimension()) {}

  std::optional<plane<S, D>> operator()(std::span<const std::int32_t> near) {
    if (std::ssize(near) < points_.dimension()) return std::nullopt;
    const vector origin = at(near[0]);
    mean_.setZero();
    for (const auto i : near) mean_ += at(i) - origin;
    mean_ /= double(near.size());
    scatter_.setZero();
    for (const auto i : near) {
      const vector difference = at(i) - origin - mean_;
      scatter_.noalias() += difference * difference.transpose();
    }
    const double rounding = rounding_of<S>((origin + mean_).cwiseAbs().maxCoeff(),
                                           std::sqrt(scatter_.trace() / double(near.size())));
    return plane<S, D>::of(scatter_, 4 * double(near.size()) * rounding * rounding);
  }

 private:
  using vector = point_vector<double, D>;
  [[nodiscard]] vector at(index_t i) const { return points_[i].template cast<double>(); }

  points_view<S, D> points_;
  vector mean_;
  Eigen::Matrix<double, D, D> scatter_;
};

/// Fits a plane by a covariance that somebody else estimates.
template <Scalar S, int D>
struct estimated_fit {
  points_view<S, D> points;
  const covariance_function<S, D>& estimate;

  std::optional<plane<S, D>> operator()(std::span<const std::int32_t> near) const {
    const auto found = estimate(points, near);
    if (!found || found->count < points.dimension()) return std::nullopt;
    const Eigen::Matrix<double, D, D>& covariance = found->covariance;
    const double extent = std::sqrt(std::max(covariance.trace(), 0.0));
    const double rounding = rounding_of<S>(double(found->mean.cwiseAbs().maxCoeff()), extent);
    // The covariance is rounded, too.
    return plane<S, D>::of(
        covariance, 4 * rounding * rounding + std::numeric_limits<S>::epsilon() * extent * extent);
  }
};

template <Scalar S>
detail::plane_fit<S>* plane_kernel() {
  return detail::for_target(static_cast<int>(current_vector_target()),
                            []<detail::kernel_target V> { return detail::plane_fit_in<V, S>(); });
}

/// Where fitted planes go, with their normals on the side that is asked for.
template <Scalar S, int D>
class plane_writer {
 public:
  plane_writer(points_view<S, D> points, const normals_options& options,
               const normals_target<S, D>& out)
      : points_{points}, out_{out} {
    if (options.viewpoint) {
      viewpoint_ = options.viewpoint->as<S, D>(
          points.dimension(),
          "estimate_normals: the viewpoint must have the dimension of the points");
      expects(is_finite(*viewpoint_), "estimate_normals: the viewpoint must be finite");
    }
    parallel_for(points.size(), {.threads = options.threads}, [&](index_t i) {
      out_.normals[i].setZero();
      if (out_.curvature) out_.curvature[i] = 0;
    });
  }

  void write(index_t i, const plane<S, D>& found) {
    S side;
    if (viewpoint_) {
      side = found.normal.dot(*viewpoint_ - points_[i]);
    } else {
      index_t largest;
      found.normal.cwiseAbs().maxCoeff(&largest);
      side = found.normal[largest];
    }
    out_.normals[i] = side < 0 ? (-found.normal).eval() : found.normal;
    if (out_.curvature) out_.curvature[i] = found.curvature;
  }

 private:
  points_view<S, D> points_;
  std::optional<point_vector<S, D>> viewpoint_;
  normals_target<S, D> out_;
};

/// Fits planes to a block of neighbourhoods, some at a time where there are kernels for that.
template <Scalar S, int D>
void fit_block(points_view<S, D> points, const neighborhood_block<S>& block,
               plane_writer<S, D>& out) {
  least_squares_fit<S, D> fit{points};
  const auto fit_one = [&](index_t i) {
    if (const auto found = fit(block[i].indices())) out.write(block.query(i), *found);
  };
  if constexpr (D != 3) {
    for (index_t i = 0; i < block.size(); ++i) fit_one(i);
  } else {
    constexpr int lanes = detail::planes_at_a_time;
    const auto& fit_many = *plane_kernel<S>();
    detail::plane_members<S> members{points.data(), points.stride(), {}, {}};
    detail::fitted_planes planes;
    for (index_t begin = 0; begin < block.size(); begin += lanes) {
      const auto count = static_cast<int>(std::min<index_t>(lanes, block.size() - begin));
      for (int k = 0; k < lanes; ++k) {
        members.counts[k] = 0;
        if (k >= count) continue;
        const auto near = block[begin + k].indices();
        if (std::ssize(near) > detail::most_plane_members) {
          fit_one(begin + k);
        } else {
          members.indices[k] = near.data();
          members.counts[k] = static_cast<std::int32_t>(near.size());
        }
      }
      fit_many(members, planes);
      for (int k = 0; k < count; ++k)
        if (planes.are_determined[k])
          out.write(
              block.query(begin + k),
              {Eigen::Vector3d{planes.normals[0][k], planes.normals[1][k], planes.normals[2][k]}
                   .template cast<S>(),
               static_cast<S>(planes.curvatures[k])});
    }
  }
}

template <Scalar S, int D>
void visit(points_view<S, D> points, const neighborhood_spec& spec, const normals_options& options,
           bool ascending, const neighborhood_visitor<S>& f) {
  const kd_tree<S, D> tree{points, {.threads = options.threads}};
  visit_neighborhoods(
      tree, points, spec, f,
      {.ascending = ascending, .threads = options.threads, .monitor = options.monitor});
}

template <Scalar S, int D>
void visit(points_view<S, D> points, const neighborhoods<S>& near, const normals_options& options,
           bool /*as they are*/, const neighborhood_visitor<S>& f) {
  expects(near.size() == points.size(),
          "estimate_normals: there must be one neighborhood per point");
  expects(std::ranges::all_of(near.indices(),
                              [&](std::int32_t i) { return 0 <= i && i < points.size(); }),
          "estimate_normals: a neighbor is not one of the points");
  constexpr index_t at_a_time = 256;
  parallel_blocks(points.size(), at_a_time, {options.threads, options.monitor},
                  [&](index_t, index_t begin, index_t end) {
                    std::vector<std::int32_t> queries, counts;
                    std::vector<index_t> starts;
                    for (index_t i = begin; i < end; ++i) {
                      if (!is_finite(points[i])) continue;
                      queries.push_back(static_cast<std::int32_t>(i));
                      counts.push_back(static_cast<std::int32_t>(near[i].size()));
                      starts.push_back(near.offsets()[i]);
                    }
                    f({queries, starts, counts, near.indices(), near.distances()});
                  });
}

template <Scalar S, int D, class Near, class F>
void fit_planes(points_view<S, D> points, const Near& near, const normals_options& options,
                const normals_target<S, D>& target, bool ascending, F fit) {
  plane_writer<S, D> out{points, options, target};
  visit<S, D>(points, near, options, ascending,
              [&](const neighborhood_block<S>& block) { fit(block, out); });
}

}  // namespace

/// Throws `invalid_input` for neighbourhoods that no normal can come of.
void expect_enough(const neighborhood_spec& spec, index_t dimension) {
  expects(spec.max_count() >= dimension,
          "estimate_normals: a normal in " + std::to_string(dimension) + " dimensions needs " +
              std::to_string(dimension) + " neighbours, and there are " +
              std::to_string(spec.max_count()) + " at most");
}

template <Scalar S, int D, class Near>
void closed_normals(points_view<S, D> points, const Near& near, const normals_options& options,
                    const normals_target<S, D>& out) {
  constexpr bool is_searched = std::same_as<Near, neighborhood_spec>;
  if constexpr (is_searched) expect_enough(near, points.dimension());
  // An order changes the last bit, and a third of the time would be spent on one.
  fit_planes(points, near, options, out, !is_searched || options.ascending,
             [&](const auto& block, auto& writer) { fit_block(points, block, writer); });
}

template <Scalar S, int D, class Near>
void closed_normals_by(points_view<S, D> points, const Near& near, const normals_options& options,
                       const covariance_function<S, D>& estimate, const normals_target<S, D>& out) {
  if constexpr (std::same_as<Near, neighborhood_spec>) expect_enough(near, points.dimension());
  const estimated_fit<S, D> fit{points, estimate};
  fit_planes(points, near, options, out, true, [&](const auto& block, auto& writer) {
    for (index_t i = 0; i < block.size(); ++i)
      if (const auto found = fit(block[i].indices())) writer.write(block.query(i), *found);
  });
}

template <Scalar S, int D>
void expect_unit_length(points_view<S, D> normals, const char* who) {
  for (index_t i = 0; i < normals.size(); ++i) {
    const S square = normals[i].squaredNorm();
    if (std::abs(square - 1) > S(0.01) && square != 0 && std::isfinite(square))
      throw invalid_input{std::string{who} +
                          ": a normal does not have unit length; are points and normals swapped?"};
  }
}

template <Scalar S, int D>
void closed_orient(points_view<S, D> guides, const point_vector<S, D>* viewpoint,
                   mutable_points_view<S, D> normals) {
  for (index_t i = 0; i < guides.size(); ++i) {
    auto normal = normals[i];
    const S side = viewpoint ? normal.dot(*viewpoint - guides[i]) : normal.dot(guides[i]);
    if (side < 0) normal = -normal;
  }
}

#define CILANTRO_INSTANTIATE_FOR(S, D, Near)                                              \
  template void closed_normals(points_view<S, D>, const Near&, const normals_options&,    \
                               const normals_target<S, D>&);                              \
  template void closed_normals_by(points_view<S, D>, const Near&, const normals_options&, \
                                  const covariance_function<S, D>&, const normals_target<S, D>&);
#define CILANTRO_INSTANTIATE(S, D)                                                \
  CILANTRO_INSTANTIATE_FOR(S, D, neighborhood_spec)                               \
  CILANTRO_INSTANTIATE_FOR(S, D, neighborhoods<S>)                                \
  template void expect_unit_length<S, D>(points_view<S, D>, const char*);         \
  template void closed_orient<S, D>(points_view<S, D>, const point_vector<S, D>*, \
                                    mutable_points_view<S, D>);
CILANTRO_FOR_CLOSED_SPACES(CILANTRO_INSTANTIATE)
#undef CILANTRO_INSTANTIATE
#undef CILANTRO_INSTANTIATE_FOR

}  // namespace cilantro
