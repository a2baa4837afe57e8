// SPDX-License-Identifier: MIT
//
// PLY files of many exporters, some of them odd on purpose.
#include <cmath>
#include <filesystem>
#include <set>
#include <string>

#include "spaces.hpp"

import cilantro;
import test_support;

using namespace cilantro;

namespace {

/// What a file holds: vertices, the sum of all their coordinates as a check of their values, and
/// what else it knows; or, in words, why it is refused.
struct expectation {
  std::string file;
  index_t points = 0;
  double sum = 0;
  bool normals = false, colors = false;
  int attributes = 0;
  std::string refusal = {};
};

const expectation expectations[] = {
    {"diamond_pyntcloud/diamond.ply", 6, 9, true, true, 0},
    {"diamond_pyntcloud/diamond_ascii.ply", 6, 9, true, true, 1},
    {"diamond_pyntcloud/diamond_ascii_vertex_index.ply", 6, 9, true, true, 1},
    {.file = "diamond_pyntcloud/diamond_with_bool.ply",
     .refusal = "\"bool\" is no type of a PLY property"},
    {"diamond_pyntcloud/voxelgrid.ply", 6, 8.09999994, false, false, 0},
    {"emptyIO_trimesh/ply_empty_ascii.ply", 0, 0, false, false, 0},
    {"emptyIO_trimesh/ply_empty_bin.ply", 0, 0, false, false, 0},
    {.file = "emptyIO_trimesh/ply_empty_header.ply", .refusal = "the file has no vertices"},
    {"emptyIO_trimesh/ply_points_ascii.ply", 8, 0, false, false, 0},
    {"emptyIO_trimesh/ply_points_bin.ply", 8, 0, true, false, 0},
    {"pcd/pcl/cube.ply", 24, 0, false, false, 0},
    {"ply/assimp/cube.ply", 8, 12, false, false, 0},
    {"ply/assimp/cube_binary.ply", 8, 12, false, false, 0},
    {"ply/assimp/cube_binary_header_with_RN_newline.ply", 8, 12, false, false, 0},
    {"ply/assimp/cube_binary_starts_with_nl.ply", 8, 59.7402725, false, false, 0},
    {"ply/assimp/cube_uv.ply", 24, 0, true, false, 2},
    {"ply/assimp/float-color.ply", 3, 500, false, true, 1},
    {.file = "ply/assimp/issue623.ply", .refusal = "a list does not begin with its length"},
    {"ply/assimp/points.ply", 4, 4, true, true, 0},
    {"ply/happly/platonic_shelf.ply", 50, 89.777581, false, false, 0},
    {"ply/happly/platonic_shelf_ascii.ply", 50, 89.777581, false, false, 0},
    {"ply/happly/platonic_shelf_big_endian.ply", 50, 89.777581, false, false, 0},
    {"ply/open3d/bathtub_0154.ply", 1494, -14400039.9, false, false, 0},
    {"ply/open3d/color.ply", 3017, 3392.19883, true, true, 1},
    {"ply/open3d/knot.ply", 1440, -184871.175, false, false, 0},
    {"ply/open3d/sphere.ply", 642, 0, false, false, 0},
    {"ply/pdal/issue_2421.ply", 1, 1.23458024e+09, false, false, 1},
    {"ply/pdal/mesh.ply", 4, 14, false, false, 0},
    {"ply/pdal/mesh_fixed.ply", 4, 14, false, false, 0},
    {.file = "ply/pdal/no_vertex.ply", .refusal = "the file has no vertices"},
    {"ply/pdal/simple_binary.ply", 3, 1, false, false, 0},
    {"ply/pdal/simple_text.ply", 3, 1, false, false, 0},
    {.file = "ply/pdal/sized_dims.ply", .refusal = "the vertices have no x, y and z"},
    {"ply/pdal/text_extradim.ply", 1, -15.7385388, true, false, 5},
    {.file = "ply/pdal/unsized_dims.ply", .refusal = "the vertices have no x, y and z"},
    {"ply/rply/input.ply", 3, 1, false, false, 0},
    {"ply/tinyply/icosahedron.ply", 12, 0, true, false, 0},
    {"ply/tinyply/icosahedron_ascii.ply", 12, 0, true, false, 0},
    {"ply/trimesh/BoxTextured.ply", 24, 0, true, false, 2},
    {"ply/trimesh/cube_blender_uv.ply", 24, 0, true, false, 2},
    {"ply/trimesh/empty.ply", 0, 0, false, false, 0},
    {"ply/trimesh/metadata.ply", 4, 0, false, false, 0},
    {"ply/trimesh/multi.ply", 4, 0, false, true, 2},
    {"ply/trimesh/plane.ply", 4, 0, true, false, 2},
    {"ply/trimesh/plane_tri.ply", 4, 0, true, false, 2},
    {"ply/trimesh/points_ascii.ply", 5, 0.0729079, false, false, 0},
    {"ply/trimesh/points_ascii_with_lists.ply", 5, 0.0729079, false, false, 0},
    {"ply/trimesh/points_bin.ply", 5, 0.072907906, false, false, 0},
    {"ply/trimesh/points_emptyascii.ply", 12, 0.172603, false, false, 0},
    {"ply/trimesh/points_emptyface.ply", 1024, 6481.51074, false, false, 0},
    {"ply/trimesh/sphere.ply", 642, 0, false, false, 0},
    {"ply/trimesh/tet.ply", 4, 0, false, false, 0},
};

}  // namespace

TEST_CASE("every PLY file of the collection is read as expected or refused for a stated reason") {
  const auto folder = test::data_file("formats");
  SKIP_WITHOUT(folder);
  std::set<std::string> listed;
  for (const auto& e : expectations) {
    CAPTURE(e.file);
    listed.insert(e.file);
    try {
      const auto cloud = read_ply<double>(*folder / e.file);
      CHECK(e.refusal == "");
      CHECK(cloud.size() == e.points);
      CHECK(std::abs(cloud.points.sum() - e.sum) <= 1e-5 + 1e-6 * std::abs(e.sum));
      CHECK(cloud.has_normals() == e.normals);
      CHECK(cloud.has_colors() == e.colors);
      CHECK(int(cloud.attributes.size()) == e.attributes);
    } catch (const io_error& error) {
      const std::string message = error.what();
      CAPTURE(message);
      CHECK(e.refusal != "");
      CHECK(message.ends_with(e.refusal));
    }
  }
  for (const auto& entry : std::filesystem::recursive_directory_iterator{*folder})
    if (entry.path().extension() == ".ply") {
      const auto name = std::filesystem::relative(entry.path(), *folder).string();
      CAPTURE(name);
      CHECK(listed.contains(name));
    }
}

TEST_CASE("the same shape is read alike from text, from either byte order, and from any exporter") {
  const auto folder = test::data_file("formats");
  SKIP_WITHOUT(folder);
  const auto points = [&](const char* name) { return read_ply<double>(*folder / name).points; };
  CHECK(points("ply/happly/platonic_shelf_ascii.ply") == points("ply/happly/platonic_shelf.ply"));
  CHECK(points("ply/happly/platonic_shelf_big_endian.ply") ==
        points("ply/happly/platonic_shelf.ply"));
  CHECK((points("ply/tinyply/icosahedron_ascii.ply") - points("ply/tinyply/icosahedron.ply"))
            .cwiseAbs()
            .maxCoeff() < 1e-6);
  CHECK(points("diamond_pyntcloud/diamond_ascii.ply") == points("diamond_pyntcloud/diamond.ply"));
}
