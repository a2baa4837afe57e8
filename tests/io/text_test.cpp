// SPDX-License-Identifier: MIT
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "spaces.hpp"

import cilantro;
import test_support;

using namespace cilantro;

namespace {

template <int D = 3>
point_cloud<double, D> read(std::string_view text, const text_read_options& options = {}) {
  return read_text<double, D>(std::as_bytes(std::span{text}), "test.xyz", options);
}

std::string message_of(std::string_view text, const text_read_options& options = {}) {
  try {
    (void)read(text, options);
  } catch (const io_error& error) {
    return error.what();
  }
  return "no error";
}

}  // namespace

TEST_CASE("columns without names are taken for what is usual") {
  CHECK(read("1 2 3\n4 5 6\n").points == Eigen::Matrix3Xd{{1, 4}, {2, 5}, {3, 6}});
  CHECK(read("1 2 3 0.5\n").attribute_as<double>("intensity")[0] == 0.5);
  CHECK(read("1 2 3 0 0 1\n").normals.col(0) == Eigen::Vector3d{0, 0, 1});
  CHECK(read("1 2 3 255 0 51\n").colors.col(0) == Eigen::Vector3f{1, 0, 0.2f});
  const auto pts = read("1\n1 2 3 -1613 52 70 64\n");
  CHECK(pts.attribute_as<double>("intensity")[0] == -1613);
  CHECK(pts.colors(0, 0) == 52.0f / 255);
  const auto alpha = read("1 2 3 117.0 73.0 49.0 255.0\n");
  CHECK(alpha.colors(0, 0) == 117.0f / 255);
  CHECK(alpha.attribute_as<double>("alpha")[0] == 255);
  const auto both = read("1 2 3 10 20 30 0 1 0\n");
  CHECK((both.has_colors() && both.normals(1, 0) == 1));
  const auto more = read("1 2 3 4 5 6 7 8\n");
  CHECK(more.attribute_as<double>("column_4")[0] == 4);
  CHECK(more.attribute_as<double>("column_8")[0] == 8);
  CHECK(read<2>("1 2\n3 4\n").points == Eigen::Matrix2Xd{{1, 3}, {2, 4}});
}

TEST_CASE("columns are named by the first line, a comment, or the caller") {
  for (const std::string_view text :
       {"X,Y,Z,Label,R,G,B\n1,2,3,7,255,0,0\n", "//X Y Z Label R G B\n1 2 3 7 255 0 0\n",
        "# x y z Label red green blue\r\n1\t2\t3\t7\t255\t0\t0\r\n"}) {
    const auto cloud = read(text);
    CHECK(cloud.attribute_as<double>("Label")[0] == 7);
    CHECK(cloud.colors.col(0) == Eigen::Vector3f{1, 0, 0});
    CHECK(cloud.comments.empty());
  }
  const auto named = read("9 1 2 3 5\n", {.columns = {"time", "z", "y", "x", "_"}});
  CHECK(named.points.col(0) == Eigen::Vector3d{3, 2, 1});
  CHECK(named.attribute_as<double>("time")[0] == 9);
  CHECK(named.attributes.size() == 1);
  const auto remarks = read("# made by a test\n1 2 3\n# in between\n\n4 5 6\n");
  CHECK(remarks.comments == std::vector<std::string>{"made by a test", "in between"});
  CHECK(remarks.size() == 2);
}

TEST_CASE("the darkest colors are not taken for pure ones when they are spelled out") {
  CHECK(read("x y z red green blue\n1 2 3 1 0 1\n").colors.col(0) ==
        Eigen::Vector3f{1, 0, 1} / 255.0f);
  CHECK(read("x y z r g b\n1 2 3 1 0 1\n").colors.col(0) == Eigen::Vector3f{1, 0, 1});
  const test::temporary_folder folder;
  point_cloud<float, 3> cloud{.points = test::random_points<test::f3>(4)};
  cloud.colors = Eigen::Matrix3Xf::Constant(3, 4, 1 / 255.0f);
  write_text(cloud, folder / "a.xyz");
  CHECK(read_text<float>(folder / "a.xyz") == cloud);
}

TEST_CASE("a PTS file is read up to its count, and says if it goes on") {
  const auto longer = read("2\n1 2 3\n4 5 6\n7 8 9\n");
  CHECK(longer.size() == 2);
  CHECK(longer.comments ==
        std::vector<std::string>{"the file goes on after the 2 points that it says it has"});
  CHECK(message_of("3\n1 2 3\n4 5 6\n")
            .find("line 3: the file ends after 2 points, and says it "
                  "has 3") != std::string::npos);
  CHECK(message_of("4000000000\n1 2 3\n").find("more points than fit it") != std::string::npos);
  CHECK(read("0\n").empty());
}

TEST_CASE("lines that are wrong are refused with their number") {
  const auto names = [](std::string_view text, const char* what) {
    const auto message = message_of(text);
    CAPTURE(message);
    CHECK(message.find(what) != std::string::npos);
  };
  names("1 2 3\n4 5\n", "line 2: this line has another number of values");
  names("1 2 3\n4 5 6 7\n", "line 2: this line has another number of values");
  names("1 2 3\n4 five 6\n", "line 2: \"five\" is no number");
  names("1 2 3\n4 5 6x\n", "line 2: \"6x\" is no number");
  names("1 2\n", "the points have two coordinates, and three are asked for");
  names("x y z z\n1 2 3 4\n", "\"z\" comes twice");
  names("x y z w\n1 2 3\n", "3 columns, and 4 names");
  names("hello world\n", "\"hello\" is no number");
  CHECK(message_of("1 2 3\n", {.columns = {"x", "y", "z", "w"}}).find("4 were named") !=
        std::string::npos);
  CHECK_THROWS_AS((void)read("1 2 3\n", {.columns = {"a", "b", "c"}}), invalid_input);
  CHECK(message_of("+1 2 -3e2\n") == "no error");
  CHECK(read("nan -inf 1e-400\n").points(2, 0) == 0);
  CHECK(read("").empty());
  CHECK(read("\n\n# nothing\n").empty());
  CHECK(read_text<float>(std::as_bytes(std::span{std::string_view{"\n"}})).empty());
}

TEST_CASE_TEMPLATE("what is written as text is read back to the bit", T, CLOUD_SPACES) {
  using S = typename T::scalar;
  using limits = std::numeric_limits<S>;
  const test::temporary_folder folder;
  point_cloud<S, T::static_dimension> cloud;
  cloud.points = test::random_points<T>(500, 1, -100, 100);
  const S odd[] = {limits::quiet_NaN(),  limits::infinity(), -limits::infinity(), -S(0),
                   limits::denorm_min(), limits::max(),      limits::lowest()};
  for (index_t i = 0; i < 7; ++i) cloud.points(1, i) = odd[i];
  cloud.normals = test::random_points<T>(500, 2);
  cloud.colors.resize(3, 500);
  std::vector<double> time;
  for (index_t i = 0; i < 500; ++i) {
    for (index_t c = 0; c < 3; ++c) cloud.colors(c, i) = float((i + c) % 256) / 255.0f;
    time.push_back(double(i) / 3);
  }
  cloud.set_attribute("time", time);
  for (const char* name : {"a.xyz", "a.csv", "a.txt", "a.ASC"}) {
    write_cloud(cloud, folder / name);
    const auto back = read_cloud<S, T::static_dimension>(folder / name);
    CHECK(test::same_bits(back.points, cloud.points));
    CHECK(std::signbit(back.points(1, 3)));
    CHECK(back.normals == cloud.normals);
    CHECK(back.colors == cloud.colors);
    CHECK(back.attributes == cloud.attributes);
  }
}

TEST_CASE("a PTS file holds points, intensity and colors, and refuses to lose anything else") {
  const test::temporary_folder folder;
  point_cloud<float, 3> cloud{.points = test::random_points<test::f3>(9)};
  cloud.colors = Eigen::Matrix3Xf::Constant(3, 9, 51.0f / 255);
  cloud.set_attribute("intensity", std::vector<double>(9, 7.5));
  cloud | write_cloud(folder / "a.pts");
  CHECK(test::read_file(folder / "a.pts").starts_with("9\n"));
  const auto back = read_cloud<float>(folder / "a.pts");
  CHECK(back == cloud);
  cloud.normals = cloud.points;
  CHECK_THROWS_AS(write_cloud(cloud, folder / "b.pts"), invalid_input);
  const point_cloud<float, 2> flat{.points = test::random_points<test::f2>(3)};
  CHECK_THROWS_AS(write_cloud(flat, folder / "b.pts"), invalid_input);
  CHECK(folder.count() == 1);
}

TEST_CASE("a file is read and written by its ending, and an unknown one is refused") {
  const test::temporary_folder folder;
  const point_cloud<float, 3> cloud{.points = test::random_points<test::f3>(9)};
  for (const char* name : {"a.ply", "a.PCD", "a.xyz", "a.csv", "a.pts"}) {
    cloud | write_cloud(folder / name);
    CHECK(read_cloud<float>(folder / name) == cloud);
  }
  CHECK(test::read_file(folder / "a.PCD").find("DATA binary") != std::string::npos);
  CHECK_THROWS_AS(write_cloud(cloud, folder / "a.laz"), invalid_input);
  CHECK_THROWS_WITH_AS((void)read_cloud<float>("a.obj"),
                       "read_cloud: \"a.obj\" does not end in .ply, .pcd, .las, .xyz, .txt, .asc, "
                       ".csv or .pts; .laz, .e57, .ptx, .npy and .bin are read, too",
                       invalid_input);
  CHECK_THROWS_AS(write_text(cloud, folder / "b.txt", {.separator = 'x'}), invalid_input);
  CHECK_THROWS_AS((void)read_cloud<float>(folder / "missing.xyz"), io_error);
}

TEST_CASE("reading and writing text report their progress, and can be stopped") {
  const test::temporary_folder folder;
  const point_cloud<float, 3> cloud{.points = test::random_points<test::f3>(20000)};
  std::vector<double> shares;
  const task_monitor watching{.progress = [&](double s) { shares.push_back(s); }};
  write_text(cloud, folder / "a.xyz", {.monitor = watching});
  CHECK((shares.size() > 1 && shares.back() == 1));
  shares.clear();
  (void)read_text<float>(folder / "a.xyz", {.monitor = watching});
  CHECK((shares.size() > 1 && shares.back() == 1));
  std::stop_source stop;
  stop.request_stop();
  const task_monitor stopping{.stop = stop.get_token()};
  CHECK_THROWS_AS((void)read_text<float>(folder / "a.xyz", {.monitor = stopping}), cancelled);
  CHECK_THROWS_AS(write_text(cloud, folder / "b.xyz", {.monitor = stopping}), cancelled);
  CHECK(folder.count() == 1);
}

TEST_CASE_TEMPLATE("a matrix is written and read to the bit, as text and in NumPy's format", S,
                   float, double) {
  using limits = std::numeric_limits<S>;
  const test::temporary_folder folder;
  Eigen::MatrixX<S> matrix = Eigen::MatrixX<S>::Random(7, 5);
  matrix.col(1) << limits::quiet_NaN(), limits::infinity(), -limits::infinity(), -S(0),
      limits::denorm_min(), limits::max(), limits::lowest();
  for (const auto format : {matrix_format::text, matrix_format::npy}) {
    write_matrix(matrix, folder / "m", format);
    CHECK(test::same_bits(read_matrix<S>(folder / "m"), matrix));
    write_matrix(matrix.leftCols(0), folder / "m", format);
    CHECK(read_matrix<S>(folder / "m").size() == 0);
  }
  const auto text = test::read_file(folder / "m");
  CHECK((text.size() % 64 == 0 && text.starts_with("\x93NUMPY")));
}

TEST_CASE("matrices that are wrong are refused with their place") {
  const auto message = [](std::string_view text) -> std::string {
    try {
      (void)read_matrix<double>(std::as_bytes(std::span{text}));
    } catch (const io_error& error) {
      return error.what();
    }
    return "no error";
  };
  const auto npy = [](std::string header, std::string_view data = "") {
    std::string text{"\x93NUMPY\x01"};
    text += '\0';
    text += static_cast<char>(header.size());
    text += '\0';
    return text + header + std::string{data};
  };
  const auto names = [&](std::string_view text, const char* what) {
    CAPTURE(message(text));
    CHECK(message(text).find(what) != std::string::npos);
  };
  names("1 2\n3\n", "line 2: this row has another number of values");
  names("1 2\n3 x\n", "line 2: \"x\" is no number");
  names(npy("{}"), "no \"descr\"");
  names(npy("{'descr': '<c8', 'fortran_order': False, 'shape': (1,)}"), "is none of integers");
  names(npy("{'descr': '<f4', 'fortran_order': False, 'shape': (1,2,3)}"), "more than two");
  names(npy("{'descr': '<f4', 'fortran_order': False, 'shape': (1000000,)}"), "more numbers than");
  names(npy("{'descr': '<f4', 'fortran_order': maybe, 'shape': (1,)}", "1234"), "in which order");
  names("\x93NUMPY\x09\x01", "version");
  const auto column = npy("{'descr': '>i2', 'fortran_order': False, 'shape': (2,)}",
                          std::string_view{"\x01\x02\xff\xff", 4});
  const auto read = read_matrix<float>(std::as_bytes(std::span{column}));
  CHECK((read.rows() == 2 && read.cols() == 1 && read(0) == 258 && read(1) == -1));
}
