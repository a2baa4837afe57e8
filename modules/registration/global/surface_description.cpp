// SPDX-License-Identifier: MIT
module;
#include "core/closed_spaces.hpp"
module cilantro.registration;

import cilantro.eigen;
import cilantro.features;
import :surface_check;
import :surface_description;

namespace cilantro {
namespace {

template <int D>
std::optional<point_vector<double, D>> local_viewpoint(const std::optional<coordinates>& viewpoint,
                                                       const std::optional<coordinates>& anchor) {
  if (!viewpoint) return std::nullopt;
  constexpr const char* dimension =
      "align_globally: a viewpoint must have the dimension of the points";
  auto place = viewpoint->as<double, D>(D, dimension);
  if (anchor) place += anchor->as<double, D>(D, dimension);
  expects(is_finite(place), "align_globally: a viewpoint must be finite");
  return place;
}

/// Of more voxels, so many get a feature: matching all with all takes their square.
constexpr index_t most_features = 10000;

/// Square roots tell histograms apart better: Arandjelovic & Zisserman 2012, "Three things everyone
/// should know to improve object retrieval", section 2.
template <int D>
void describe(voxel_surface<D>& surface, bool oriented, const surface_options& options) {
  const point_matrix<float, D> points = surface.points.template cast<float>(),
                               normals = surface.normals.template cast<float>();
  surface.described = random_indices(points.cols(), most_features);
  fpfh_options how{.oriented = oriented, .threads = options.threads, .monitor = options.monitor};
  if (points.cols() > most_features) how.at = surface.described;
  surface.features =
      fpfh(points, normals, options.features.value_or(radius{5 * options.voxel}), how).cwiseSqrt();
}

}  // namespace

template <Scalar S, int D>
voxel_surface<D> reduced_to_voxels(const global_input<S, D>& input,
                                   const surface_options& options) {
  const task_monitor stop_only{{}, options.monitor.stop};
  voxel_surface<D> surface;
  auto viewpoint = local_viewpoint<D>(options.viewpoint, input.anchor);
  point_matrix<S, D> points(D, 0), normals(D, 0);
  if (!input.points.empty()) {
    const voxel_grid<S, D> grid{
        input.points,
        options.voxel,
        {.origin = input.anchor, .threads = options.threads, .monitor = stop_only}};
    for (index_t g = 0; g < grid.groups().size(); ++g) surface.first.push_back(grid.groups()[g][0]);
    points = group_means(input.points, grid.groups(), {.threads = options.threads});
    normals = input.normals.empty()
                  ? estimate_normals(points, options.normals.value_or(radius{2 * options.voxel}),
                                     {.threads = options.threads, .monitor = stop_only})
                        .normals
                  : group_directions(input.normals, grid.groups(), {.threads = options.threads});
  }
  surface.points = points.template cast<double>();
  surface.normals = normals.template cast<double>();
  if (points.cols() > 0) surface.center = surface.points.rowwise().mean();
  surface.points.colwise() -= surface.center;
  surface.tree.emplace(surface.points, kd_tree_options{.threads = options.threads});
  if (!viewpoint) return surface;
  *viewpoint -= surface.center;
  for (index_t i = 0; i < points.cols(); ++i) {
    auto normal = surface.normals.col(i);
    if (normal.dot(*viewpoint - surface.points.col(i)) < 0) normal = -normal;
  }
  surface.seen.emplace(surface.points, *viewpoint, options.voxel);
  return surface;
}

template <Scalar S, int D>
std::shared_ptr<const surface_description> closed_describe(const global_input<S, D>& input,
                                                           const surface_options& options) {
  expect_between(0, options.voxel, std::numeric_limits<double>::max(), "align_globally: voxel");
  expects(options.voxel > 0,
          "align_globally: .voxel is required, in the units of the points: about the size of the "
          "smallest details that still tell places apart, such as 0.05 m in a room");
  if constexpr (D != dynamic) {
    auto described = std::make_shared<surface_description>();
    described->voxel = options.voxel;
    described->oriented = options.oriented || options.viewpoint;
    auto surface = reduced_to_voxels(input, options);
    describe(surface, described->oriented, options);
    if (surface.points.cols() == 0 && options.monitor.progress) options.monitor.progress(1);
    if constexpr (D == 2)
      described->flat = std::move(surface);
    else
      described->solid = std::move(surface);
    return described;
  } else {
    const index_t d = input.points.dimension();
    expects(d == 2 || d == 3 || input.points.empty(),
            "align_globally: points must have two or three dimensions");
    if (d == 2) return closed_describe(fixed_input<2>(input), options);
    return closed_describe(fixed_input<3>(input), options);
  }
}

index_t voxels_of(const surface_description& surface) {
  return surface.flat ? surface.flat->points.cols() : surface.solid->points.cols();
}
const Eigen::MatrixXf& features_of(const surface_description& surface) {
  return surface.flat ? surface.flat->features : surface.solid->features;
}

#define CILANTRO_INSTANTIATE(S, D)                                                               \
  template std::shared_ptr<const surface_description> closed_describe(const global_input<S, D>&, \
                                                                      const surface_options&);
CILANTRO_FOR_CLOSED_SPACES(CILANTRO_INSTANTIATE)
#undef CILANTRO_INSTANTIATE
#define CILANTRO_INSTANTIATE(S, D) \
  template voxel_surface<D> reduced_to_voxels(const global_input<S, D>&, const surface_options&);
CILANTRO_INSTANTIATE(float, 2)
CILANTRO_INSTANTIATE(float, 3)
CILANTRO_INSTANTIATE(double, 2)
CILANTRO_INSTANTIATE(double, 3)
#undef CILANTRO_INSTANTIATE

}  // namespace cilantro
