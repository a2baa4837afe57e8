// SPDX-License-Identifier: MIT
//
// Files as other programs write them, and what must survive writing and reading.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <iterator>
#include <limits>
#include <span>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include "spaces.hpp"

import cilantro;
import test_support;

using namespace cilantro;

namespace {

template <class S = double>
point_cloud<S, 3> read(std::string_view text, const text_read_options& options = {}) {
  return read_text<S>(std::as_bytes(std::span{text}), "test.xyz", options);
}

std::string message_of(auto&& call) {
  try {
    call();
  } catch (const std::exception& error) {
    return error.what();
  }
  return "no error";
}

}  // namespace

TEST_CASE("several scans in a PTS file are one cloud") {
  CHECK(read("2\n1 2 3\n4 5 6\n3\n7 8 9\n1 1 1\n2 2 2\n").size() == 5);
  CHECK(read("1\n1 2 3\n\n\n").size() == 1);
  CHECK(message_of([] { (void)read("1\n1 2 3\n2\n4 5 6\n"); }) ==
        "test.xyz, line 4: the file ends after 2 points, and says it has 3");
  // What has a count has no normals: black stays a colour, and so does the darkest red.
  const auto black = read("2\n1 2 3 0 0 0\n4 5 6 0 0 0\n");
  CHECK((black.has_colors() && !black.has_normals()));
  CHECK(read("1\n1 2 3 7 1 0 0\n").colors(0, 0) == 1.0f / 255);
}

TEST_CASE("where semicolons separate, commas are decimal") {
  for (const std::string_view text :
       {"0,50;1,25;-2,75\n1;2,5;3\n", "x;y;z\n0,50;1,25;-2,75\n1;2,5;3\n",
        "0,50; 1,25; -2,75;\n1;2,5;3\n"}) {
    const auto cloud = read(text);
    CHECK(cloud.points == Eigen::Matrix3Xd{{0.5, 1}, {1.25, 2.5}, {-2.75, 3}});
    CHECK(!cloud.has_colors());
  }
  CHECK(read("0.5,1.25,2\n").points.col(0) == Eigen::Vector3d{0.5, 1.25, 2});
}

TEST_CASE("where white space separates numbers such as 1,5, commas are decimal") {
  for (const std::string_view text :
       {"0,50 1,25 -2,75\n1 2,5 3\n", "x y z\n0,50\t1,25\t-2,75\n1\t2,5\t3\n",
        "2\n0,50 1,25 -2,75\n1 2,5 3\n", "0,5 1,25 -27,5e-1\n+1 2,5 3\n"}) {
    const auto cloud = read(text);
    CHECK(cloud.points == Eigen::Matrix3Xd{{0.5, 1}, {1.25, 2.5}, {-2.75, 3}});
    CHECK(!cloud.has_colors());
  }
  for (const std::string_view text : {"1,2,3\n", "1, 2, 3\n", "1 ,2 ,3\n", " 1,2,3 \n"})
    CHECK(read(text).points.col(0) == Eigen::Vector3d{1, 2, 3});
  // The first point may have none.
  CHECK(read("0 0 0\n1,5 2 2,5\n").points.col(1) == Eigen::Vector3d{1.5, 2, 2.5});
  CHECK(read("0,5 1 2 wall\n", {.columns = {"x", "y", "z", "_"}}).points.col(0) ==
        Eigen::Vector3d{0.5, 1, 2});
}

TEST_CASE("where commas may separate or be decimal, somebody must say which") {
  const std::string_view text = "10 20 30,255\n";
  CHECK(message_of([&] { (void)read(text); }) ==
        "test.xyz, line 1: commas may separate here or be decimal: say which by the option "
        "decimal_commas");
  CHECK(read(text, {.decimal_commas = true}).points(2, 0) == 30.255);
  const auto separated = read(text, {.decimal_commas = false});
  CHECK(separated.points(2, 0) == 30);
  CHECK(separated.attribute_as<double>("intensity")[0] == 255);
  // As many names as there are columns tell, too.
  CHECK(read("x y z intensity\n10 20 30,255\n").points(2, 0) == 30);
  CHECK(read("x y z\n10 20 30,255\n").points(2, 0) == 30.255);
}

TEST_CASE(
    "a head may be quoted, in any order, behind a mark of byte order, and beside words that nobody "
    "wants") {
  CHECK(read("\"X\",\"Y\",\"Z\",\"Intensity\"\n1,2,3,4\n").attribute_as<double>("Intensity")[0] ==
        4);
  const auto later = read("time,x,y,z\n9,1,2,3\n");
  CHECK(later.points.col(0) == Eigen::Vector3d{1, 2, 3});
  CHECK(later.attribute_as<double>("time")[0] == 9);
  CHECK(read("\xEF\xBB\xBFx,y,z\n1,2,3\n").points.col(0) == Eigen::Vector3d{1, 2, 3});
  CHECK(read("\xEF\xBB\xBF"
             "1 2 3\n")
            .size() == 1);
  const text_read_options named{.columns = {"_", "_", "x", "y", "z"}};
  const auto words = read("id,name,east,north,up\n1,a,1,2,3\n2,b,4,5,6\n", named);
  CHECK(words.points == Eigen::Matrix3Xd{{1, 4}, {2, 5}, {3, 6}});
  CHECK(words.attributes.empty());
}

TEST_CASE("lines may end in a carriage return alone, and numbers be none as Windows spelled it") {
  CHECK(read("1 2 3\r4 5 6\r").points == Eigen::Matrix3Xd{{1, 4}, {2, 5}, {3, 6}});
  CHECK(read("1 2 3\r\n4 5 6\r\n").size() == 2);
  const auto odd = read("-1.#IND 1.#QNAN 1.#INF\n1 2 -1.#INF\n");
  CHECK((std::isnan(odd.points(0, 0)) && std::isnan(odd.points(1, 0))));
  CHECK(odd.points(2, 0) == test::infinity<double>);
  CHECK(odd.points(2, 1) == -test::infinity<double>);
  CHECK(message_of([] { (void)read("1.#X 2 3\n"); }) == "test.xyz, line 1: \"1.#X\" is no number");
}

TEST_CASE("a point that strays does not take the others with it") {
  for (const std::string_view stray : {"12345678.9", "-9999999.9", "1e30"}) {
    std::string text;
    Eigen::Matrix3Xd truth(3, 500);
    for (int i = 0; i < 500; ++i) {
      truth.col(i) << 0.001 * (i % 10), 0.01 * (i / 10 % 10), 0.37 * (i / 100);
      for (int d = 0; d < 3; ++d) text += std::to_string(truth(d, i)) + (d < 2 ? " " : "\n");
    }
    for (int d = 0; d < 3; ++d) (text += stray) += d < 2 ? " " : "\n";
    const auto cloud = read<float>(text);
    const Eigen::Matrix3Xd world =
        cloud.points.leftCols(500).cast<double>().colwise() + cloud.full_origin();
    CHECK((world - truth).cwiseAbs().maxCoeff() < 1e-6);
  }
}

TEST_CASE("floating colours above 1 are from 0 to 255, and what cannot be written is refused") {
  const test::temporary_folder folder;
  for (const std::string type : {"float", "double"}) {
    test::write_file(folder / "c.ply",
                     "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\n"
                     "property float z\nproperty " +
                         type + " red\nproperty " + type + " green\nproperty " + type +
                         " blue\nend_header\n0 0 0 128 64 255\n1 1 1 204 0 1\n");
    const auto cloud = read_ply<float>(folder / "c.ply");
    CHECK(cloud.colors ==
          Eigen::Matrix3Xf{{128 / 255.0f, 0.8f}, {64 / 255.0f, 0}, {1, 1 / 255.0f}});
    write_ply(cloud, folder / "again.ply");
    CHECK(read_ply<float>(folder / "again.ply") == cloud);
  }
  CHECK(read("x y z red green blue\n1 2 3 0.5 0.25 1\n").colors.col(0) ==
        Eigen::Vector3f{0.5f, 0.25f, 1});
  CHECK(read("x y z red green blue\n1 2 3 127.5 0 255\n").colors.col(0) ==
        Eigen::Vector3f{0.5f, 0, 1});
  CHECK(read("x y z red green blue\n1 2 3 1.0000005 0 0.5\n").colors.col(0) ==
        Eigen::Vector3f{1, 0, 0.5f});
  point_cloud<float, 3> cloud{.points = Eigen::Matrix3Xf::Zero(3, 2)};
  for (const float wrong : {128.0f, -0.5f, test::nan<float>}) {
    cloud.colors = Eigen::Matrix3Xf::Zero(3, 2);
    cloud.colors(1, 1) = wrong;
    CHECK_THROWS_AS(write_ply(cloud, folder / "no.ply"), invalid_input);
    CHECK_THROWS_AS(write_pcd(cloud, folder / "no.pcd"), invalid_input);
    CHECK_THROWS_AS(write_text(cloud, folder / "no.xyz"), invalid_input);
  }
}

TEST_CASE_TEMPLATE("what is written as text is read as the same, whatever names and comments say",
                   S, float, double) {
  const test::temporary_folder folder;
  const point_cloud<S, 3> plain{.points =
                                    Eigen::Matrix<S, 3, dynamic>{{0.5, 2.25}, {3.5, 4}, {5, 6.75}}};
  for (const std::string name : {"450", "nan", "1e5", "x1", "R"})
    for (const std::string file : {"t.xyz", "t.csv"}) {
      auto cloud = plain;
      cloud.set_attribute(name, std::vector<double>{7.5, 250.25});
      write_cloud(cloud, folder / file);
      CHECK(read_cloud<S>(folder / file) == cloud);
    }
  auto skipped = plain;
  skipped.set_attribute("_", std::vector<double>{1, 2});
  CHECK_THROWS_AS(write_cloud(skipped, folder / "t.xyz"), invalid_input);
  for (const std::string comment : {"x y attribute", "x y z", "origin 1 2 3", "1 2 3"})
    for (const std::string file : {"t.xyz", "t.ply", "t.pcd"}) {
      auto cloud = plain;
      cloud.comments = {comment};
      write_cloud(cloud, folder / file);
      CHECK(read_cloud<S>(folder / file) == cloud);
    }
  point_cloud<S, 3> empty;
  empty.set_attribute("intensity", std::vector<double>{});
  write_cloud(empty, folder / "t.xyz");
  CHECK(read_cloud<S>(folder / "t.xyz") == empty);
  auto black = plain;
  black.colors = Eigen::Matrix3Xf::Zero(3, 2);
  write_cloud(black, folder / "t.pts");
  CHECK(read_cloud<S>(folder / "t.pts") == black);
}

TEST_CASE("floats far from zero keep their bits in text, and doubles there their digits") {
  const test::temporary_folder folder;
  const point_cloud<float, 3> far{
      .points = Eigen::Matrix3Xf{{12345.679f, 1}, {0.25f, 3}, {-20000.1f, 7}}};
  for (const std::string file : {"f.xyz", "f.csv"}) {
    write_cloud(far, folder / file);
    CHECK(read_cloud<float>(folder / file) == far);
  }
  // Half of the points were not measured.
  const auto holes =
      read<float>("0 0 0\n0 0 0\n500000.125 4600000.375 1\n500001.125 4600001.625 2\n0 0 0\n");
  CHECK((holes.points.col(3).cast<double>() + holes.full_origin()) ==
        Eigen::Vector3d{500001.125, 4600001.625, 2});
  CHECK((holes.points.col(0).cast<double>() + holes.full_origin()).isZero(0));
  const auto map = read<float>("500000.125 4600000.375 1\n500001.125 4600001.625 2\n");
  CHECK(map.has_origin());
  CHECK((map.points.cast<double>().colwise() + map.full_origin()).col(0) ==
        Eigen::Vector3d{500000.125, 4600000.375, 1});
}

TEST_CASE("arrays of rows and raw floats are clouds") {
  const test::temporary_folder folder;
  Eigen::MatrixXd rows(3, 4);
  rows << 1, 2, 3, 0.5, 4, 5, 6, 0.25, 500000.125, 8, 9, 1;
  write_matrix(rows, folder / "a.npy");
  const auto cloud = read_cloud<double>(folder / "a.npy");
  CHECK(cloud.points == rows.leftCols(3).transpose());
  CHECK(cloud.attribute_as<double>("intensity")[2] == 1);
  CHECK(read_cloud<float>(folder / "a.npy").size() == 3);
  write_matrix(Eigen::MatrixXd::Zero(3, 2).eval(), folder / "b.npy");
  CHECK_THROWS_AS((void)read_cloud<float>(folder / "b.npy"), io_error);
  CHECK_THROWS_AS(write_cloud(cloud, folder / "c.npy"), invalid_input);

  const std::vector<float> values{1, 2, 3, 0.5f, 4, 5, 6, 0.25f};
  std::string bytes(values.size() * sizeof(float), '\0');
  std::memcpy(bytes.data(), values.data(), bytes.size());
  test::write_file(folder / "k.bin", bytes);
  const auto scan = read_cloud<float>(folder / "k.bin");
  CHECK(scan.points == Eigen::Matrix3Xf{{1, 4}, {2, 5}, {3, 6}});
  CHECK(scan.attribute_as<float>("intensity")[1] == 0.25f);
  test::write_file(folder / "k.bin", bytes + "x");
  CHECK_THROWS_AS((void)read_cloud<float>(folder / "k.bin"), io_error);
  test::write_file(folder / "k.bin", "");
  CHECK(read_cloud<float>(folder / "k.bin").empty());
}

TEST_CASE("other programs' fields are understood or passed over") {
  const test::temporary_folder folder;
  test::write_file(folder / "d.ply",
                   "ply\rformat ascii 1.0\relement vertex 1\rproperty float x\rproperty float y\r"
                   "property float z\rproperty uchar diffuse_red\rproperty uchar diffuse_green\r"
                   "property uchar diffuse_blue\rend_header\r1 2 3 255 0 51\r");
  const auto cloud = read_ply<float>(folder / "d.ply");
  CHECK(cloud.points.col(0) == Eigen::Vector3f{1, 2, 3});
  CHECK(cloud.colors.col(0) == Eigen::Vector3f{1, 0, 0.2f});
  test::write_file(folder / "o.ply",
                   "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
                   "property float z\nend_header\n1e40 2 3\n");
  CHECK_THROWS_AS((void)read_ply<float>(folder / "o.ply"), io_error);
  test::write_file(
      folder / "p.pcd",
      "VERSION 0.7\nFIELDS x y z _ ring\nSIZE 4 4 4 1 2\nTYPE F F F U U\nCOUNT 1 1 1 0 1\n"
      "WIDTH 1\nHEIGHT 1\nPOINTS 1\nDATA ascii\n1 2 3 7\n");
  const auto padded = read_pcd<float>(folder / "p.pcd");
  CHECK(padded.attribute_as<std::uint16_t>("ring")[0] == 7);
}

TEST_CASE("attributes are set from any numbers, and read as any type that holds them") {
  point_cloud<float, 3> cloud{.points = Eigen::Matrix3Xf::Zero(3, 3)};
  const std::vector<std::int32_t> labels{0, -1, 2};
  cloud.set_attribute("label", std::span{labels});
  cloud.set_attribute("weight", {0.5f, 1.0f, 2.0f});
  cloud.set_attribute("mask", std::vector<bool>{true, false, true});
  CHECK(cloud.attribute_as<std::int32_t>("label")[2] == 2);
  CHECK(cloud.attribute_as<float>("weight")[0] == 0.5f);
  CHECK(cloud.attribute_as<std::uint8_t>("mask")[0] == 1);
  CHECK(cloud.attribute_to<double>("label") == std::vector<double>{0, -1, 2});
  CHECK(cloud.attribute_to<int>("mask") == std::vector<int>{1, 0, 1});
  CHECK(message_of([&] { (void)cloud.attribute_to<unsigned>("label"); }) ==
        "the attribute \"label\" has the value -1, which uint32 cannot hold");
  CHECK(message_of([&] { (void)cloud.attribute_to<int>("weight"); }) ==
        "the attribute \"weight\" has the value 0.5, which int32 cannot hold");
  CHECK(message_of([&] { (void)cloud.attribute_as<float>("label"); }) ==
        "the attribute \"label\" holds int32, and float was requested");
  std::ostringstream out;
  out << cloud;
  CHECK(out.str() == "3 points in 3D, label (int32), weight (float), mask (uint8)");
}

TEST_CASE("width and height survive every format that has comments") {
  const test::temporary_folder folder;
  const point_cloud<float, 3> cloud{
      .points = test::random_points<test::f3>(6), .width = 3, .height = 2};
  for (const std::string file : {"w.ply", "w.pcd", "w.xyz"}) {
    write_cloud(cloud, folder / file);
    CHECK(read_cloud<float>(folder / file) == cloud);
  }
  // What does not fit the points is a comment like others.
  point_cloud<float, 3> odd{.points = cloud.points, .comments = {"cilantro size 4 2"}};
  write_cloud(odd, folder / "w.ply");
  CHECK(read_cloud<float>(folder / "w.ply") == odd);
}
