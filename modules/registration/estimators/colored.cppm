// SPDX-License-Identifier: MIT
//
// Points and colours together, or any other value that a surface has at each of its points.
export module cilantro.registration:colored;

import cilantro.standard;
import cilantro.core;
import cilantro.search;
import cilantro.geometry;
import :residual;

namespace cilantro {

/// The distance to the plane of the target point, and the difference in colour: what planes leave
/// open, such as sliding along a wall, a picture on the wall decides. Chosen in the options of
/// `align`, `{.metric = colored{}}`, for clouds with colours; `colored{.attribute = "intensity"}`
/// for clouds with an attribute of that name and any type of number. Voxels of `.scales` have the
/// mean of their values. `colored_point_to_plane` says what is minimised, and takes values of
/// yours.
export struct colored {
  /// How much the colours count beside the planes: from 0, not at all, to 1, alone. Independent of
  /// all units, and so not Open3D's 1 − `lambda_geometric`: its 0.032 is about 0.3 here.
  double share = 0.3;
  /// The attribute that takes the place of the colours; empty: the colours' brightness, the mean of
  /// red, green and blue.
  std::string attribute = {};
  /// The neighbourhoods for the gradients of the target; see `value_gradients`.
  neighborhood_spec gradients = knn{20};
};

/// The two rows of coloured ICP, for values of yours over points of any kind: the distance e of a
/// pair along the target's normal, and the difference c of the values, both lengths:
///
///   E = (1 − share) Σ e² + share Σ c²,   c = (v(t) + g(t) · (q − t) − v(s)) / γ,
///
/// where v is the value of the target point t and of the source point s, q is the source point,
/// moved, g is the gradient of the value at t, and γ the root mean square of all g. So c is how far
/// the point has to move along a gradient of usual size to explain the difference. Neither the unit
/// of the values nor that of the points changes the result, robust kernels take both rows in the
/// unit of the points, and the eigenvalues of the verdict remain shares. In the source, c is the
/// difference itself, whose weight loses a factor of 10⁶ from metres to millimetres. The source's
/// share of 0.032 for metres and colours in [0, 1] is a share of 0.032 γ² / (0.968 + 0.032 γ²)
/// here: 0.29 for γ = 3.5 per metre, 0.45 for 5, which two indoor scenes in voxels of 1 cm have.
///
/// A pair whose difference is not known, as a value or the gradient is NaN, counts by its distance
/// only; so do all if the target's value is the same everywhere. Pairs whose target normal is
/// unknown do not count. Noise counts as colour: where values are nothing else, planes alone give
/// the truer verdict. Holds a copy of the values, which copies of it share.
/// Source: Park, Zhou & Koltun 2017, "Colored point cloud registration revisited", whose objective
/// is σ Σ e² + (1 − σ) Σ (γ c)².
export template <int D>
class colored_point_to_plane {
 public:
  static constexpr bool needs_target_normals = true;

  /// One value per source point and per target point, in the same unit, and the gradients of the
  /// target, `Dim × N`, as `value_gradients` finds them. Throws `invalid_input` unless there is one
  /// gradient per target value, and for a share that is not from 0 to 1.
  template <PointwiseNumbers A, PointwiseNumbers B, PointwiseVectors G>
  colored_point_to_plane(const A& source_values, const B& target_values, const G& target_gradients,
                         double share = colored{}.share)
      : data_{std::make_shared<const values>(values{
            rounded_values::of(source_values).values, rounded_values::of(target_values).values,
            closed_points(target_gradients).matrix().template cast<double>()})} {
    weigh(share);
  }

  template <int E, class Emit>
  void operator()(const matched_pair<E>& pair, const Emit& emit) const {
    using vector = typename matched_pair<E>::vector;
    if (pair.target_normal.isZero(0)) return;
    const vector difference = pair.point - pair.target;
    if (along_normal_ > 0)
      emit(along_normal_ * difference.dot(pair.target_normal),
           vector{along_normal_ * pair.target_normal});
    if (!(along_gradient_ > 0)) return;
    const vector gradient = along_gradient_ * data_->gradients.col(pair.target_index);
    const double value =
        along_gradient_ * (data_->target[pair.target_index] - data_->source[pair.source_index]) +
        gradient.dot(difference);
    if (std::isfinite(value)) emit(value, gradient);
  }

  /// Throws `invalid_input`, naming the function `who`, if there are not as many points as values.
  void expect_sizes(index_t sources, index_t targets, const char* who) const {
    expects(std::ssize(data_->source) == sources && std::ssize(data_->target) == targets,
            std::string{who} + ": there are " + std::to_string(sources) + " and " +
                std::to_string(targets) + " points, but the metric has " +
                std::to_string(data_->source.size()) + " and " +
                std::to_string(data_->target.size()) + " values");
  }

 private:
  struct values {
    std::vector<double> source, target;
    point_matrix<double, D> gradients;
  };

  void weigh(double share) {
    expect_between(0, share, 1, "colored: the share of the colors");
    const auto& gradients = data_->gradients;
    expects(gradients.cols() == std::ssize(data_->target),
            "colored: there must be one gradient per target value");
    double squares = 0;
    index_t known = 0;
    for (index_t i = 0; i < gradients.cols(); ++i) {
      const double square = gradients.col(i).squaredNorm();
      if (!std::isfinite(square)) continue;
      squares += square;
      ++known;
    }
    along_normal_ = std::sqrt(1 - share);
    if (squares > 0) along_gradient_ = std::sqrt(share * double(known) / squares);
  }

  std::shared_ptr<const values> data_;
  double along_normal_ = 0, along_gradient_ = 0;
};
export template <PointwiseNumbers A, PointwiseNumbers B, PointwiseVectors G>
colored_point_to_plane(const A&, const B&, const G&, double = 0)
    -> colored_point_to_plane<closed_dimension<dimension_of<G>>>;

static_assert(ResidualTerm<colored_point_to_plane<2>, 2> &&
              ResidualTerm<colored_point_to_plane<3>, 3> &&
              ResidualTerm<colored_point_to_plane<dynamic>, dynamic>);

}  // namespace cilantro
