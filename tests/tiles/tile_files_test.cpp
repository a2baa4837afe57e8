// SPDX-License-Identifier: MIT
#include <doctest/doctest.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>
#include <algorithm>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

import cilantro;
import test_support;
import tile_support;
using namespace cilantro;
using test::check_same;
using test::terrain;
namespace fs = std::filesystem;

namespace {

std::string text_of(const fs::path& path) {
  std::ifstream in{path, std::ios::binary};
  return {std::istreambuf_iterator<char>{in}, std::istreambuf_iterator<char>{}};
}
void write_text_of(const fs::path& path, const std::string& text) {
  std::ofstream{path, std::ios::binary} << text;
}

/// How a child process ends that does `work`.
template <class F>
int status_of_child(F work) {
  const pid_t child = ::fork();
  if (child == 0) {
    try {
      work();
    } catch (...) {
      ::_exit(3);
    }
    ::_exit(0);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  return status;
}

}  // namespace

TEST_CASE("files, a folder and a pattern are opened in the order of names") {
  const test::temporary_folder folder;
  const auto ground = terrain<float>(3000);
  for (const int part : {0, 1, 2})
    write_ply(select(ground, index_list{part, part + 10, part + 20}),
              folder / ("strip_" + std::to_string(part) + ".ply"));
  write_text_of(folder / "readme.md", "no points");
  CHECK(open_tiles<float>(folder.path()).size() == 9);
  CHECK(open_tiles<float>(folder / "strip_?.ply").size() == 9);
  CHECK(open_tiles<float>(folder / "*_2*").size() == 3);
  CHECK(open_tiles<float>(folder / "strip_1.ply").size() == 3);
  const std::vector<fs::path> two{folder / "strip_2.ply", folder / "strip_0.ply"};
  CHECK(open_tiles<float>(two).files() == two);
  CHECK_THROWS_AS((void)open_tiles<float>(folder / "x*"), invalid_input);
  CHECK_THROWS_AS((void)open_tiles<float>(folder / "none.ply"), io_error);
  CHECK_THROWS_AS((void)open_tiles<float>(folder / "readme.md"), invalid_input);
  CHECK_THROWS_AS((void)open_tiles<float>(folder / "no/where/*.ply"), io_error);
}

TEST_CASE("a cloud without points, and one with one, are tiled") {
  const test::temporary_folder folder;
  write_ply(point_cloud<float, 3>{}, folder / "none.ply");
  const auto none = open_tiles<float>(folder / "none.ply");
  CHECK(none.size() == 0);
  CHECK(none.tiles().empty());
  CHECK(none.read().empty());
  CHECK_THROWS_AS((void)none.bounds(), invalid_input);
  CHECK((none | estimate_normals(knn{5}) | write_tiles(folder / "t")).size() == 0);
  point_cloud<float, 3> one;
  one.points = Eigen::Vector3f{1, 2, 3};
  write_ply(one, folder / "one.ply");
  const auto single = open_tiles<float>(folder / "one.ply") | estimate_normals(knn{5}) |
                      remove_statistical_outliers() | write_tiles(folder / "u");
  CHECK(single.read().size() == 1);
}

TEST_CASE("options that make no sense are errors") {
  CHECK_THROWS_WITH_AS((void)open_tiles<float>("no_such_survey"),
                       doctest::Contains("there is no such file or folder"), io_error);
  CHECK_THROWS_AS((void)write_clusters("out", radius{1}, {.threads = 2}), invalid_input);
  const std::stop_source stop;
  CHECK_THROWS_AS((void)write_clusters("out", radius{1}, {.monitor = {.stop = stop.get_token()}}),
                  invalid_input);
  CHECK_THROWS_AS((void)write_clusters("out", dbscan_options{.radius = 1, .threads = 2}),
                  invalid_input);
  const test::temporary_folder folder;
  write_ply(terrain<float>(1000), folder / "a.ply");
  const auto path = folder / "a.ply";
  CHECK_THROWS_AS((void)open_tiles<float>(path, {.edge = -1}), invalid_input);
  CHECK_THROWS_AS((void)open_tiles<float>(path, {.edge = 1e-300}), invalid_input);
  CHECK_THROWS_AS((void)open_tiles<float>(path, {.threads = -1}), invalid_input);
  CHECK_THROWS_AS((void)with_reach(-1, [](point_cloud<float, 3> c) { return c; }), invalid_input);
  const auto survey = open_tiles<float>(path, {.edge = 10});
  CHECK_THROWS_AS((void)survey.read_tile(-1), invalid_input);
  CHECK_THROWS_AS((void)survey.read_tile(std::ssize(survey.tiles())), invalid_input);
  CHECK_THROWS_AS(for_each_tile(survey, halo{-1}, [](auto&) {}), invalid_input);
  CHECK_THROWS_AS((void)write_tiles(survey, folder / "t", {.format = ".xyz"}), invalid_input);
  CHECK_THROWS_WITH_AS((void)(open_tiles<float>(path, {.edge = 10, .memory = 1_MB}).read()),
                       doctest::Contains("smaller edge, or more memory"), invalid_input);
}

TEST_CASE("floating colours of a file have one unit in all tiles") {
  const test::temporary_folder folder;
  for (const std::string format : {"ascii", "binary_little_endian"}) {
    constexpr int count = 70'000;
    std::string text =
        "ply\nformat " + format + " 1.0\nelement vertex " + std::to_string(count) +
        "\nproperty float x\nproperty float y\nproperty float z\nproperty float red\n"
        "property float green\nproperty float blue\nend_header\n";
    for (int i = 0; i < count; ++i) {
      // Dark where the file does not begin.
      const float values[]{float(i), 0, 0, i < 1000 ? 200.0f : 1.0f, 0, 0};
      if (format == "ascii")
        text += std::to_string(i) + " 0 0 " + (i < 1000 ? "200" : "1") + " 0 0\n";
      else
        text.append(reinterpret_cast<const char*>(values), sizeof values);
    }
    write_text_of(folder / (format + ".ply"), text);
    const auto survey = open_tiles<float>(folder / (format + ".ply"), {.edge = 20'000});
    const auto whole = read_ply<float>(folder / (format + ".ply"));
    CHECK((survey.read().colors == whole.colors));
    CHECK((survey.read_tile(3).colors.array() <= 1.0f / 255).all());
    const auto tiles = survey | write_tiles(folder / format);
    CHECK((tiles.read_tile(3).colors.array() <= 1.0f / 255).all());
  }
}

TEST_CASE("no two write into a folder at once") {
  const test::temporary_folder folder;
  write_ply(terrain<float>(2000), folder / "a.ply");
  const auto survey = open_tiles<float>(folder / "a.ply", {.edge = 10});
  const auto other = [&](double) {
    CHECK_THROWS_WITH_AS((void)write_tiles(survey, folder / "t", {.resume = true}),
                         doctest::Contains("another process"), invalid_input);
  };
  CHECK(write_tiles(survey, folder / "t", {.monitor = {.progress = other}}).read().size() == 2000);
}

TEST_CASE("an index with squares of another edge is an error") {
  const test::temporary_folder folder;
  write_ply(terrain<float>(2000), folder / "a.ply");
  (void)(open_tiles<float>(folder / "a.ply", {.edge = 10}) | write_tiles(folder / "t"));
  const auto index = text_of(folder / "t" / "tiles.index");
  const auto at = index.find("\nedge 10") + 1;
  for (const std::string edge : {"edge 7", "edge 1e-300", "edge 1000"}) {
    auto wrong = index;
    write_text_of(folder / "t" / "tiles.index", wrong.replace(at, 7, edge));
    CHECK_THROWS_AS((void)open_tiles<float>(folder / "t"), io_error);
  }
}

TEST_CASE("an edge is chosen that suits most points") {
  const test::temporary_folder folder;
  auto ground = terrain<float>(200'000);  // Around the origin.
  write_ply(ground, folder / "ground.ply");
  CHECK(open_tiles<float>(folder / "ground.ply").edge() < 1000);
  ground.points.col(7) << 1e9f, 0, 0;
  write_ply(ground, folder / "stray.ply");
  const auto survey = open_tiles<float>(folder / "stray.ply", {.memory = 12_MB, .threads = 1});
  CHECK(survey.edge() < 100);
  CHECK(survey.read().size() == ground.size());
}

TEST_CASE("a folder with some of its tiles is not opened as if it had all") {
  const test::temporary_folder folder;
  write_ply(terrain<float>(1000), folder / "a.ply");
  const auto survey =
      open_tiles<float>(folder / "a.ply", {.edge = 10, .threads = 1}) | voxel_downsample(1);
  const auto stop = [](double share) {
    if (share > 0.5) throw std::runtime_error{"enough"};
  };
  CHECK_THROWS_WITH((void)write_tiles(survey, folder / "t", {.monitor = {.progress = stop}}),
                    "enough");
  CHECK_THROWS_WITH_AS((void)open_tiles<float>(folder / "t"), doctest::Contains("only some"),
                       invalid_input);
  (void)write_tiles(survey, folder / "t", {.resume = true});
  CHECK_NOTHROW((void)open_tiles<float>(folder / "t"));
}

TEST_CASE("a folder that is not empty is not written to") {
  const test::temporary_folder folder;
  write_ply(terrain<float>(1000), folder / "a.ply");
  const auto survey = open_tiles<float>(folder / "a.ply", {.edge = 10});
  CHECK_THROWS_AS((void)write_tiles(survey, folder.path()), invalid_input);
  (void)write_tiles(survey, folder / "t");
  CHECK_THROWS_AS((void)write_tiles(survey, folder / "t"), invalid_input);
  // Resuming what is complete gives what is there, and is refused for anything else.
  CHECK(write_tiles(survey, folder / "t", {.resume = true}).size() == 1000);
  CHECK_THROWS_AS((void)write_tiles(survey | voxel_downsample(1), folder / "t", {.resume = true}),
                  invalid_input);
  CHECK_THROWS_AS((void)write_tiles(survey, folder / "a.ply"), io_error);
  CHECK_THROWS_AS((void)write_tiles(survey, folder / std::string(300, 'x')), io_error);
}

TEST_CASE("a run that has not finished a tile is begun anew, with anything else") {
  const test::temporary_folder folder;
  write_ply(terrain<float>(2000), folder / "a.ply");
  const auto survey = open_tiles<float>(folder / "a.ply", {.edge = 10});
  const auto small = open_tiles<float>(folder / "a.ply", {.edge = 20, .memory = 1_MB});
  const auto outliers = remove_statistical_outliers() | estimate_normals(knn{5});
  const auto fails = with_reach(0, [](const point_cloud<float, 3>&) -> point_cloud<float, 3> {
    throw std::logic_error{"x"};
  });
  CHECK_THROWS_AS((void)(small | outliers | write_tiles(folder / "t")), invalid_input);
  CHECK_THROWS_AS((void)(survey | fails | write_tiles(folder / "t")), std::logic_error);
  CHECK_THROWS_AS((void)(survey | fails | outliers | write_tiles(folder / "t")), std::logic_error);
  CHECK_THROWS_AS((void)(survey | fails | write_clusters(folder / "t", radius{1})),
                  std::logic_error);
  CHECK(fs::exists(folder / "t/tiles.unfinished"));
  CHECK((survey | write_tiles(folder / "t")).size() == 2000);
  CHECK_THROWS_AS((void)(survey | fails | write_tiles(folder / "u")), std::logic_error);
  CHECK((survey | outliers | write_tiles(folder / "u", {.resume = true})).size() > 1000);
}

TEST_CASE("what a process has left that was killed after the last tile is removed") {
  const test::temporary_folder folder;
  write_ply(terrain<float>(1000), folder / "a.ply");
  const auto survey = open_tiles<float>(folder / "a.ply", {.edge = 10});
  const auto out = folder / "t";
  const auto tiles = survey | write_tiles(out);
  const auto count = [&] {
    return std::distance(fs::directory_iterator{out}, fs::directory_iterator{});
  };
  const auto clean = count();
  const auto leave_things = [&] {
    fs::create_directories(out / "pass-1");
    write_text_of(out / "pass-1/0_0.ply", "");
    for (const char* name : {"tiles.unfinished", "tiles.unfinished.2", "labels-0.sets", "p.part"})
      write_text_of(out / name, "what it was\n");
    CHECK(count() == clean + 5);
  };
  leave_things();
  CHECK(write_tiles(survey, out, {.resume = true}).read() == tiles.read());
  CHECK(count() == clean);
  leave_things();
  CHECK_THROWS_AS((void)write_tiles(survey, out), invalid_input);
  CHECK(count() == clean);
}

TEST_CASE("parts that a file lacks are an error that names it, and others are left out") {
  const test::temporary_folder folder;
  auto ground = terrain<float>(100);
  write_ply(ground, folder / "a.ply");
  ground.attributes.clear();
  write_ply(ground, folder / "b.ply");
  CHECK_THROWS_WITH_AS((void)open_tiles<float>(folder.path()).read(),
                       doctest::Contains("b.ply: has no attribute \"number\""), io_error);
  const std::vector<fs::path> turned{folder / "b.ply", folder / "a.ply"};
  CHECK(open_tiles<float>(turned).read().attributes.empty());
}

TEST_CASE("a file that changes after it was opened is an error") {
  const test::temporary_folder folder;
  write_ply(terrain<float>(1000), folder / "a.ply");
  const auto survey = open_tiles<float>(folder / "a.ply", {.edge = 10});
  write_ply(terrain<float>(900), folder / "a.ply");
  CHECK_THROWS_WITH_AS((void)survey.read(), doctest::Contains("has changed"), io_error);
  const auto tiles = open_tiles<float>(folder / "a.ply", {.edge = 10}) | write_tiles(folder / "t");
  fs::resize_file(tiles.files()[0], fs::file_size(tiles.files()[0]) - 1);
  CHECK_THROWS_AS((void)tiles.read(), io_error);
  CHECK_THROWS_AS((void)open_tiles<float>(folder / "t").read(), io_error);
  fs::remove(tiles.files()[0]);
  CHECK_THROWS_AS((void)open_tiles<float>(folder / "t").read(), io_error);
}

TEST_CASE("an index that is cut, or says anything else, is an error and no crash") {
  const test::temporary_folder folder;
  write_ply(terrain<float>(300), folder / "a.ply");
  (void)(open_tiles<float>(folder / "a.ply", {.edge = 40}) | write_tiles(folder / "t"));
  const auto path = folder / "t" / "tiles.index";
  const std::string good = text_of(path);
  for (std::size_t length = 0; length + 1 < good.size(); length += 7) {
    write_text_of(path, good.substr(0, length));
    CHECK_THROWS_AS((void)open_tiles<float>(folder / "t"), io_error);
  }
  for (std::size_t at = 0; at < good.size(); at += 5)
    for (const char c : {'9', '-', ' ', '\n', 'x'}) {
      auto bad = good;
      bad[at] = c;
      write_text_of(path, bad);
      try {
        (void)open_tiles<float>(folder / "t").read();
      } catch (const io_error&) {
      } catch (const invalid_input&) {
      }
    }
  auto elsewhere = good;
  elsewhere.replace(elsewhere.find("name ") + 5, 2, "../");
  write_text_of(path, elsewhere);
  CHECK_THROWS_AS((void)open_tiles<float>(folder / "t"), io_error);
}

TEST_CASE("a run that is cancelled goes on where it was, to the same result") {
  const test::temporary_folder folder;
  write_ply(terrain<float>(10'000), folder / "a.ply");
  const auto survey =
      open_tiles<float>(folder / "a.ply", {.edge = 10, .threads = 1}) | estimate_normals(knn{8});
  std::stop_source stop;
  std::vector<double> progress;
  CHECK_THROWS_AS((void)write_tiles(survey, folder / "t",
                                    {.monitor = {.progress =
                                                     [&](double share) {
                                                       progress.push_back(share);
                                                       if (share > 0.5) stop.request_stop();
                                                     },
                                                 .stop = stop.get_token()}}),
                  cancelled);
  CHECK(std::is_sorted(progress.begin(), progress.end()));
  CHECK(fs::exists(folder / "t/tiles.unfinished"));
  const auto done = std::distance(fs::directory_iterator{folder / "t"}, fs::directory_iterator{});
  CHECK(done > 3);
  // A line that was cut, and a tile that is not what was noted, are done again.
  std::ofstream{folder / "t/tiles.unfinished", std::ios::app} << "file 12 1";
  CHECK_THROWS_WITH_AS(
      (void)write_tiles(survey | voxel_downsample(1), folder / "t", {.resume = true}),
      doctest::Contains("other files, steps or options"), invalid_input);
  check_same(write_tiles(survey, folder / "t", {.resume = true}).read(), survey.read());
}

TEST_CASE("a process that is killed at any moment loses nothing but time") {
  const test::temporary_folder folder;
  write_ply(terrain<float>(20'000), folder / "a.ply");
  const auto run = [&](const fs::path& out, bool resume) {
    return open_tiles<float>(folder / "a.ply", {.edge = 8, .threads = 1}) |
           remove_statistical_outliers({.neighbors = 8}) | estimate_normals(knn{8}) |
           write_tiles(out, {.resume = resume});
  };
  const auto expected = run(folder / "whole", false).read();
  const auto out = folder / "out";
  int killed = 0;
  for (int milliseconds = 1; milliseconds < 400; milliseconds += 1 + milliseconds / 6) {
    const pid_t child = ::fork();
    if (child == 0) {
      try {
        (void)run(out, true);
      } catch (...) {
        ::_exit(3);
      }
      ::_exit(0);
    }
    std::this_thread::sleep_for(std::chrono::milliseconds{milliseconds});
    ::kill(child, SIGKILL);
    int status = 0;
    ::waitpid(child, &status, 0);
    killed += WIFSIGNALED(status);
    CHECK((WIFSIGNALED(status) || WEXITSTATUS(status) == 0));
    if (fs::exists(out)) {
      for (const auto& entry : fs::directory_iterator{out})
        if (entry.path().extension() == ".ply") CHECK(read_ply<float>(entry.path()).size() > 0);
    }
    if (fs::exists(out / "tiles.index")) break;
  }
  CHECK(killed > 0);
  // A process that is killed after the index is there may leave something that the next removes.
  (void)run(out, true);
  check_same(open_tiles<float>(out).read(), expected);
  for (const auto& entry : fs::directory_iterator{out})
    CHECK((entry.path().extension() == ".ply" || entry.path().filename() == "tiles.index"));
}

TEST_CASE("a disk that is full is an error, and what was written is resumed") {
  const test::temporary_folder folder;
  write_ply(terrain<float>(20'000), folder / "a.ply");
  const auto run = [&](bool resume) {
    return open_tiles<float>(folder / "a.ply", {.edge = 30, .threads = 1}) |
           estimate_normals(knn{8}) | write_tiles(folder / "t", {.resume = resume});
  };
  const int status = status_of_child([&] {
    ::signal(SIGXFSZ, SIG_IGN);
    const rlimit limit{100'000, 100'000};
    ::setrlimit(RLIMIT_FSIZE, &limit);
    try {
      (void)run(false);
    } catch (const io_error&) {
      ::_exit(7);
    }
  });
  CHECK(WEXITSTATUS(status) == 7);
  CHECK(!fs::exists(folder / "t/tiles.index"));
  const auto survey = open_tiles<float>(folder / "a.ply", {.edge = 30});
  check_same(run(true).read(), (survey | estimate_normals(knn{8})).read());
}

TEST_CASE("regions have all of their points, whatever the order of files and runs") {
  const test::temporary_folder folder;
  const auto ground = terrain<double>(60'000);
  (void)(open_tiles<double>(
             [&] {
               write_ply(ground, folder / "ground.ply");
               return folder / "ground.ply";
             }(),
             {.edge = 2}) |
         write_tiles(folder / "tiles"));
  std::vector<fs::path> files = open_tiles<double>(folder / "tiles").files();
  REQUIRE(files.size() > 500);
  random_stream random{3};
  for (std::size_t i = files.size(); i-- > 1;)
    std::swap(files[i], files[std::size_t(random.uniform() * double(i + 1))]);
  files.push_back(folder / "ground.ply");
  const auto survey = open_tiles<double>(files, {.edge = 10});
  const auto all = survey.read_box(survey.bounds());
  CHECK(all.size() == 2 * ground.size());
  for (int k = 0; k < 50; ++k) {
    const double size = k % 5 == 0 ? 60 : 3;
    const Eigen::Vector2d lower{-35 + 100 * random.uniform(), -45 + 60 * random.uniform()};
    const Eigen::Vector2d upper = lower + Eigen::Vector2d::Constant(size * random.uniform());
    const auto found =
        survey.read_box(box{.lower = {lower[0], lower[1]}, .upper = {upper[0], upper[1]}});
    const auto expected = select(all, [&](index_t i) {
      const Eigen::Vector2d p = all.points.col(i).head<2>() + all.origin.head<2>();
      return (p.array() >= lower.array()).all() && (p.array() <= upper.array()).all();
    });
    CHECK((found.points == expected.points));
    CHECK((found.empty() || found.attributes == expected.attributes));
  }
}

TEST_CASE("a region is found without a look at all runs of all files") {
  const test::temporary_folder folder;
  point_cloud<float, 3> one;
  one.points.setZero(3, 1);
  write_ply(one, folder / "first.ply");
  constexpr int edge = 100, files_along = 10, runs = 2000;
  std::ostringstream index;
  index << "cilantro tiles 1\nmade by a test\ndimension 3\nscalar float\nedge " << edge
        << "\norigin 0 0 0\nfiles " << files_along * files_along << '\n';
  random_stream random{5};
  for (int f = 0; f < files_along * files_along; ++f) {
    const int x = f * 7 % 100 % files_along, y = f * 7 % 100 / files_along;
    index << "file 1 " << runs << " 1 " << x << ' ' << y << ' ' << runs << ' ' << runs;
    for (int r = 0; r < runs; ++r) {
      const double px = edge * (x + 0.999 * random.uniform()),
                   py = edge * (y + 0.999 * random.uniform());
      index << " 1 " << px << ' ' << px << ' ' << py << ' ' << py << " 0 0";
    }
    index << " name " << (f == 0 ? "first" : "none" + std::to_string(f)) << ".ply\n";
  }
  index << "end\n";
  write_text_of(folder / "tiles.index", index.str());
  const auto start = std::chrono::steady_clock::now();
  const auto survey = open_tiles<float>(folder.path(), {.threads = 1});
  const auto opened = std::chrono::steady_clock::now();
  REQUIRE(survey.size() == files_along * files_along * runs);
  index_t found = 0;
  for (int k = 0; k < 1500; ++k) {
    // Between files, where there is nothing.
    const double at = edge * (1 + k % (files_along - 1)) - 0.05, along = 0.2 * k;
    found += survey.read_box(box{.lower = {at, along}, .upper = {at + 0.04, along + 1}}).size();
  }
  CHECK(found == 0);
  CHECK(std::chrono::steady_clock::now() - opened < opened - start);
}
