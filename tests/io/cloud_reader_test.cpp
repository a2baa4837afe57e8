// SPDX-License-Identifier: MIT
#include <doctest/doctest.h>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <limits>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

import cilantro;
import test_support;
using namespace cilantro;

namespace {

template <class S>
point_cloud<S, 3> example(index_t n, bool with_attributes = true) {
  point_cloud<S, 3> cloud;
  cloud.points = point_matrix<S, 3>::Random(3, n);
  cloud.normals = cloud.points.colwise().normalized();
  cloud.colors = Eigen::Matrix3Xf::Constant(3, n, 0.2f);
  if (!with_attributes) return cloud;
  std::vector<std::uint16_t> number(n);
  for (index_t i = 0; i < n; ++i) number[i] = static_cast<std::uint16_t>(i);
  cloud.set_attribute("number", attribute_values{number});
  return cloud;
}

template <class S>
point_cloud<S, 3> joined(cloud_reader<S>& reader, index_t piece) {
  point_cloud<S, 3> all = reader.read(piece);
  for (auto next = reader.read(piece); !next.empty(); next = reader.read(piece)) {
    CHECK(next.size() <= piece);
    all = append(std::move(all), next);
  }
  return all;
}

}  // namespace

TEST_CASE_TEMPLATE("pieces of a file, joined, are the whole in every format", S, float, double) {
  const test::temporary_folder folder;
  const auto cloud = example<S>(1000);
  for (const char* name : {"a.ply", "a.pcd", "a.xyz", "a.csv"}) {
    INFO(name);
    const auto path = folder / name;
    write_cloud(cloud, path);
    for (const index_t piece : {7, 333, 1000, 5000}) {
      cloud_reader<S> reader{path};
      CHECK(joined(reader, piece) == read_cloud<S>(path));
    }
  }
  write_ply(cloud, folder / "text.ply", {.format = ply_format::ascii});
  write_pcd(cloud, folder / "text.pcd", {.format = pcd_format::ascii});
  write_pcd(cloud, folder / "small.pcd", {.format = pcd_format::binary_compressed});
  for (const char* name : {"text.ply", "text.pcd", "small.pcd"}) {
    INFO(name);
    cloud_reader<S> reader{folder / name};
    CHECK(reader.size().value() == 1000);
    CHECK(joined(reader, 301) == read_cloud<S>(folder / name));
  }
}

TEST_CASE_TEMPLATE("the first piece decides the origin of all", S, float, double) {
  const test::temporary_folder folder;
  auto cloud = example<double>(500, false);
  cloud.points.colwise() += Eigen::Vector3d{4'500'000.25, 500'000.125, 30'000};
  cloud.points.rightCols(250).array() += 2000;
  write_ply(cloud, folder / "map.ply");
  cloud_reader<S> reader{folder / "map.ply"};
  const auto all = joined(reader, 100);
  const Eigen::Matrix3Xd world = all.points.template cast<double>().colwise() + all.full_origin();
  CHECK((world - cloud.points).cwiseAbs().maxCoeff() < (std::is_same_v<S, float> ? 3e-4 : 1e-9));
  CHECK(all.has_origin() == std::is_same_v<S, float>);
}

TEST_CASE("an origin that is set holds from the next piece on") {
  const test::temporary_folder folder;
  const auto cloud = example<double>(100, false);
  for (const char* name : {"a.ply", "a.pcd", "a.xyz"}) {
    write_cloud(cloud, folder / name);
    cloud_reader<double> reader{folder / name};
    reader.set_origin({1, 2, 4});
    const auto all = joined(reader, 30);
    CHECK(all.full_origin() == Eigen::Vector3d{1, 2, 4});
    CHECK((all.points.colwise() + all.origin - cloud.points).cwiseAbs().maxCoeff() < 1e-14);
    CHECK_THROWS_AS(reader.set_origin({0, 0, std::numeric_limits<double>::quiet_NaN()}),
                    invalid_input);
  }
}

TEST_CASE("a reader goes to any point of a file, forwards and back") {
  const test::temporary_folder folder;
  const auto cloud = example<float>(1000);
  for (const char* name : {"a.ply", "a.pcd", "a.xyz"}) {
    INFO(name);
    write_cloud(cloud, folder / name);
    cloud_reader<float> reader{folder / name};
    for (const std::uint64_t first : {500u, 999u, 3u, 0u, 640u}) {
      reader.seek(first);
      CHECK(reader.read(1).points.col(0) == cloud.points.col(static_cast<index_t>(first)));
    }
    reader.seek(1000);
    CHECK(reader.read(5).empty());
    reader.seek(5000);
    CHECK(reader.read(5).empty());
    reader.seek(998);
    CHECK(reader.read(5).size() == 2);
  }
}

TEST_CASE("a scan of KITTI is read in pieces") {
  const test::temporary_folder folder;
  const auto path = folder / "scan.bin";
  Eigen::Matrix4Xf values = Eigen::Matrix4Xf::Random(4, 1000);
  std::ofstream{path, std::ios::binary}.write(reinterpret_cast<const char*>(values.data()),
                                              values.size() * sizeof(float));
  cloud_reader<float> reader{path};
  CHECK(reader.size().value() == 1000);
  CHECK(joined(reader, 64).points == values.topRows(3));
  reader.seek(10);
  CHECK(reader.read(2).points == values.topRows(3).middleCols(10, 2));
}

TEST_CASE("floating colours have one unit in all pieces, that of the first") {
  const test::temporary_folder folder;
  std::ofstream{folder / "a.xyz"} << "# x y z r g b\n0 0 0 0.5 255 0\n1 1 1 0.25 1 0.5\n";
  cloud_reader<float> reader{folder / "a.xyz"};
  CHECK(reader.read(1).colors(1, 0) == 1.0f);
  CHECK(reader.read(1).colors(1, 0) == 1.0f / 255);
}

TEST_CASE("colours of a text that are no longer whole numbers are an error that names the line") {
  const test::temporary_folder folder;
  std::ofstream{folder / "a.xyz"} << "0 0 0 10 255 0\n1 1 1 0.25 1 0.5\n";
  cloud_reader<float> reader{folder / "a.xyz"};
  CHECK(reader.read(1).has_colors());
  CHECK_THROWS_WITH_AS((void)reader.read(1), doctest::Contains("line 2"), io_error);
}

TEST_CASE("a file that is cut is an error where it ends") {
  const test::temporary_folder folder;
  write_ply(example<float>(20'000), folder / "a.ply");
  cloud_reader<float> reader{folder / "a.ply"};
  std::filesystem::resize_file(folder / "a.ply", std::filesystem::file_size(folder / "a.ply") - 50);
  CHECK_THROWS_AS((void)joined(reader, 10), io_error);
  CHECK_THROWS_AS(cloud_reader<float>{folder / "none.ply"}, io_error);
  CHECK_THROWS_AS(cloud_reader<float>{folder / "a.gif"}, invalid_input);
  CHECK_THROWS_AS((void)reader.read(0), invalid_input);
}
