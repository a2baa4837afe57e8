// SPDX-License-Identifier: MIT
module cilantro.visualization;

namespace cilantro {
namespace {

/// One for all, or one each.
void expect_as_many(index_t given, index_t wanted, const char* what, const char* things) {
  expects(given == 1 || given == wanted, "canvas: there are " + std::to_string(given) + " " + what +
                                             " for " + std::to_string(wanted) + " " + things +
                                             ": give one for all, or one for each");
}
template <class Batch>
void expect_batch(const Batch& batch, index_t colored, const char* things) {
  expect_between(0, batch.opacity, 1, "canvas: the opacity");
  expects(is_finite(batch.origin), "canvas: the origin of a batch must be finite");
  expect_as_many(batch.colors.cols(), colored, "colours", things);
}

void expect_indices(const auto& indices, index_t points) {
  expects(indices.size() == 0 || (0 <= indices.minCoeff() && indices.maxCoeff() < points),
          "canvas: an index is not one of a point");
}

void extend(Eigen::AlignedBox3d& box, const Eigen::Matrix3Xf& points,
            const Eigen::Vector3d& origin) {
  Eigen::AlignedBox3f own;
  for (const auto p : points.colwise())
    if (is_finite(p)) own.extend(p);
  if (own.isEmpty()) return;
  box.extend(own.min().cast<double>() + origin);
  box.extend(own.max().cast<double>() + origin);
}

}  // namespace

void canvas::add(point_batch batch) {
  const index_t n = batch.points.cols();
  expect_batch(batch, n, "points");
  expects(batch.normals.cols() == 0 || batch.normals.cols() == n,
          "canvas: points need as many normals, or none");
  expects(!batch.along_normals || batch.normals.cols() == n,
          "canvas: splats along normals need normals");
  expect_as_many(batch.size.sizes.size(), n, "sizes", "points");
  expects(batch.size.sizes.size() == 0 ||
              (batch.size.sizes.allFinite() && batch.size.sizes.minCoeff() >= 0),
          "canvas: the sizes of points must be finite and not negative");
  extend(bounds_, batch.points, batch.origin);
  points_.push_back(std::move(batch));
}

void canvas::add(line_batch batch) {
  const index_t n = batch.points.cols();
  if (batch.segments.cols() == 0) {
    expects(n % 2 == 0, "canvas: without .segments, two points are a line each");
    batch.segments.resize(2, n / 2);
    for (index_t i = 0; i < n; ++i) batch.segments(i % 2, i / 2) = int(i);
  }
  expect_batch(batch, batch.segments.cols(), "lines");
  expect_indices(batch.segments, n);
  expects(batch.width > 0 && batch.width <= 1000, "canvas: lines are from 0 to 1000 pixels wide");
  extend(bounds_, batch.points, batch.origin);
  lines_.push_back(std::move(batch));
}

void canvas::add(triangle_batch batch) {
  const index_t n = batch.points.cols();
  expect_batch(batch, n, "points of triangles");
  expect_indices(batch.triangles, n);
  expects(batch.normals.cols() == 0 || batch.normals.cols() == n,
          "canvas: triangles need a normal for each point, or none");
  if (batch.texture) {
    expects(!batch.texture->pixels().empty(), "canvas: a texture must have pixels");
    expects(batch.texture_places.cols() == n && batch.texture_places.allFinite(),
            "canvas: triangles with a texture need a finite place in it for each point");
    expects(batch.colors.cols() == 1,
            "canvas: triangles have a texture or colours of points, not both");
  } else {
    expects(batch.texture_places.cols() == 0, "canvas: places in a texture need a .texture");
  }
  extend(bounds_, batch.points, batch.origin);
  triangles_.push_back(std::move(batch));
}

void canvas::add(label text) {
  expects(text.height > 0 && text.height <= 1000, "canvas: letters are from 0 to 1000 pixels high");
  if (!is_finite(text.place)) return;
  bounds_.extend(text.place);
  labels_.push_back(std::move(text));
}

void canvas::add(color_legend legend) {
  expects(!legend.colors.empty(), "canvas: a legend needs colours");
  expects(std::isfinite(legend.low) && std::isfinite(legend.high),
          "canvas: the values at the ends of a legend must be finite");
  legends_.push_back(std::move(legend));
}

}  // namespace cilantro
