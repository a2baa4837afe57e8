// SPDX-License-Identifier: MIT
#include <atomic>
#include <chrono>
#include <iterator>
#include <ranges>
#include <stdexcept>
#include <stop_token>
#include <thread>
#include <utility>
#include <vector>

#include "spaces.hpp"

import cilantro;
import test_support;

using namespace cilantro;
namespace ranges = std::ranges;

namespace {

std::vector<point_cloud<float, 3>> some_frames(int count = 4) {
  std::vector<point_cloud<float, 3>> frames;
  for (int i = 0; i < count; ++i)
    frames.push_back({.points = test::random_points<test::f3>(100 + 10 * i, std::uint64_t(i))});
  return frames;
}

// How often each number has been worked on.
struct counted_work {
  std::vector<std::atomic<int>>* counts;
  int operator()(int i) const {
    ++(*counts)[std::size_t(i)];
    return 10 * i;
  }
};

using each_of_vector =
    decltype(std::declval<std::vector<point_cloud<float, 3>>&>() | each(voxel_downsample(0.1)));
static_assert(ranges::input_range<each_of_vector> && ranges::view<each_of_vector>);
static_assert(!ranges::forward_range<each_of_vector> && !ranges::borrowed_range<each_of_vector>);
static_assert(std::same_as<ranges::range_value_t<each_of_vector>, point_cloud<float, 3>>);

}  // namespace

TEST_CASE("each frame is sent through the step") {
  auto frames = some_frames();
  const auto prepare = voxel_downsample(0.4) | estimate_normals(knn{6});
  for (const int ahead : {0, 1, 3, 20}) {
    std::size_t i = 0;
    for (const auto& cloud : frames | each(prepare, {.ahead = ahead}))
      CHECK(cloud == (frames[i++] | prepare));
    CHECK(i == 4);
  }
}

TEST_CASE("each frame is done once, however the views behind it ask") {
  for (const int ahead : {0, 2}) {
    std::vector<std::atomic<int>> counts(8);
    std::vector<int> found;
    for (const int x : std::views::iota(0, 8) | each(counted_work{&counts}, {.ahead = ahead}) |
                           std::views::filter([](int y) { return y % 20 == 0; }) |
                           std::views::transform([](int y) { return y + 1; }))
      found.push_back(x);
    CHECK(found == std::vector{1, 21, 41, 61});
    for (const auto& count : counts) CHECK(count == 1);
  }
}

TEST_CASE("nothing is done for frames that are not asked for") {
  std::vector<std::atomic<int>> counts(8);
  const auto view = std::views::iota(0, 8) | each(counted_work{&counts});
  for (const auto& count : counts) CHECK(count == 0);
  int sum = 0;
  for (const int x : std::views::iota(0, 8) | each(counted_work{&counts}) | std::views::take(3))
    sum += x;
  CHECK(sum == 30);
  CHECK((counts[2] == 1 && counts[3] == 0));
  for (const int x : std::views::iota(0, 8) | each(counted_work{&counts}) |
                         std::views::take_while([](int y) { return y < 30; }))
    sum += x;
  CHECK(sum == 60);
  CHECK((counts[3] == 1 && counts[4] == 0));
}

TEST_CASE("no more frames are prepared ahead than asked for") {
  std::vector<std::atomic<int>> counts(100);
  auto view = std::views::iota(0, 100) | each(counted_work{&counts}, {.ahead = 3});
  auto i = view.begin();
  CHECK(*i == 0);
  ++i;
  CHECK(*i == 10);
  std::this_thread::sleep_for(std::chrono::milliseconds{50});
  // The one in use, and three more.
  CHECK(counts[5] == 0);
}

TEST_CASE("closures of ranges compose before there is a range") {
  const auto work = each([](int i) { return i * i; }) | std::views::take(3);
  const auto after = std::views::drop(1) | each([](int i) { return i + 1; });
  const auto both = work | after;
  std::vector<int> found;
  for (const int x : std::vector{1, 2, 3, 4} | both) found.push_back(x);
  CHECK(found == std::vector{5, 10});
}

TEST_CASE("frames of a view that makes them are made once and moved into the step") {
  for (const int ahead : {0, 2}) {
    int made = 0;
    const auto make = [&](int i) {
      ++made;
      return point_cloud<float, 3>{.points = test::random_points<test::f3>(50 + i)};
    };
    index_t total = 0;
    for (auto& cloud : std::views::iota(0, 5) | std::views::transform(make) |
                           each(remove_invalid(), {.ahead = ahead}) |
                           each(voxel_downsample(0.01), {.ahead = ahead}))
      total += cloud.size();
    CHECK(made == 5);
    CHECK(total == 260);
  }
}

TEST_CASE("an exception of a frame arrives where that frame is asked for") {
  const auto work = [](int i) {
    if (i == 3) throw std::runtime_error{"frame 3"};
    return i;
  };
  for (const int ahead : {0, 1, 4}) {
    std::vector<int> found;
    CHECK_THROWS_WITH_AS(
        [&] {
          for (const int x : std::views::iota(0, 8) | each(work, {.ahead = ahead}))
            found.push_back(x);
        }(),
        "frame 3", std::runtime_error);
    CHECK(found == std::vector{0, 1, 2});
  }
}

TEST_CASE("an exception of whoever fetches frames arrives after those before it") {
  const auto fetch = std::views::transform([](int i) {
    if (i == 2) throw std::runtime_error{"no frame 2"};
    return i;
  });
  for (const int ahead : {0, 1, 4}) {
    std::vector<int> found;
    CHECK_THROWS_WITH_AS(
        [&] {
          for (const int x :
               std::views::iota(0, 8) | fetch | each([](int i) { return i; }, {.ahead = ahead}))
            found.push_back(x);
        }(),
        "no frame 2", std::runtime_error);
    CHECK(found == std::vector{0, 1});
  }
}

TEST_CASE("frames after one that could not be fetched or done are there, ahead or not") {
  const auto fetch = std::views::transform([](int i) {
    if (i == 1) throw std::runtime_error{"no frame"};
    return i;
  });
  const auto work = [](int i) {
    if (i == 3) throw std::runtime_error{"no result"};
    return i;
  };
  for (const int ahead : {0, 1, 4}) {
    auto view = std::views::iota(0, 6) | fetch | each(work, {.ahead = ahead});
    std::vector<int> found;
    int failed = 0;
    for (auto i = view.begin(); i != view.end(); ++i) {
      try {
        found.push_back(*i);
      } catch (const std::runtime_error&) {
        ++failed;
      }
    }
    CHECK(found == std::vector{0, 2, 4, 5});
    CHECK(failed == 2);
  }
}

TEST_CASE("a result may look into its frame until the next one is asked for") {
  auto frames = some_frames(6);
  const auto prepare = voxel_downsample(0.4);
  const auto look = [](const point_cloud<float, 3>& cloud) { return as_points(cloud.points); };
  const auto make = std::views::transform([&](int i) { return frames[std::size_t(i)] | prepare; });
  for (const int ahead : {0, 2}) {
    std::size_t i = 0;
    for (const auto& points : frames | each(prepare) | each(look, {.ahead = ahead}))
      CHECK(points.matrix() == (frames[i++] | prepare).points);
    i = 0;
    for (const auto& points : std::views::iota(0, 6) | make | each(look, {.ahead = ahead}))
      CHECK(points.matrix() == (frames[i++] | prepare).points);
    CHECK(i == 6);
  }
}

TEST_CASE("steps that write beside the cloud are refused ahead") {
  auto frames = some_frames();
  pipeline_report report;
  index_list removed;
  icp_result<Eigen::Isometry3f> found;
  const auto refused = [&](auto step) {
    CHECK_NOTHROW((void)(frames | each(step)));
    CHECK_THROWS_AS((void)(frames | each(step, {.ahead = 1})), invalid_input);
  };
  refused(report_each(report, remove_invalid() | voxel_downsample(0.1)));
  refused(remove_invalid() | remove_statistical_outliers({}, &removed));
  refused(voxel_downsample(0.1) | write_ply("out.ply"));
  refused(align_to(frames[0], {}, &found));
  CHECK_NOTHROW((void)(frames | each(remove_statistical_outliers(), {.ahead = 1})));
}

TEST_CASE("a report of each step may be of one frame after another") {
  auto frames = some_frames(3);
  pipeline_report report;
  for (const auto& cloud : frames | each(report_each(report, remove_invalid() | take(7))))
    CHECK(cloud.size() == 7);
  REQUIRE(report.stages().size() == 9);
  CHECK((report.stages()[3].name == "input" && report.stages()[3].points_in == 110));
  CHECK((report.stages()[6].points_in == 120 && report.stages()[8].points_out == 7));
}

TEST_CASE("a stop that a step is told arrives as cancelled, ahead or not") {
  auto frames = some_frames();
  for (const int ahead : {0, 2}) {
    std::stop_source stop;
    stop.request_stop();
    auto view = frames | each(voxel_downsample(0.1, {.monitor = {.stop = stop.get_token()}}),
                              {.ahead = ahead});
    CHECK_THROWS_AS((void)*view.begin(), cancelled);
  }
}

TEST_CASE("a view of frames can be moved, gone through again, and left at any place") {
  for (const int ahead : {0, 2}) {
    auto view = std::vector{1, 2, 3} | each([](int i) { return 2 * i; }, {.ahead = ahead});
    auto moved = std::move(view);
    for (int round = 0; round < 2; ++round) {
      int sum = 0;
      for (const int x : moved) sum += x;
      CHECK(sum == 12);
    }
    CHECK(*moved.begin() == 2);
    CHECK(*ranges::next(moved.begin(), 2) == 6);
  }
  CHECK(ranges::distance(std::vector<int>{} | each([](int i) { return i; }, {.ahead = 3})) == 0);
  CHECK_THROWS_AS((void)(std::vector{1} | each([](int i) { return i; }, {.ahead = -1})),
                  invalid_input);
}

TEST_CASE("frames are folded into a cloud, a function, or what has add") {
  auto frames = some_frames();
  const auto prepare = voxel_downsample(0.4);
  point_cloud<float, 3> by_hand;
  for (const auto& cloud : frames) by_hand = append(std::move(by_hand), cloud | prepare);

  point_cloud<float, 3> map;
  CHECK(&(frames | each(prepare) | accumulate_into(map)) == &map);
  CHECK(map == by_hand);
  map = frames[0];
  CHECK((frames | std::views::drop(1) | accumulate_into(map)) == append_all(frames));

  index_t total = 0;
  const auto count = [&](const point_cloud<float, 3>& cloud) { total += cloud.size(); };
  frames | each(prepare, {.ahead = 2}) | accumulate_into(count);
  CHECK(total == by_hand.size());

  struct sizes {
    std::vector<index_t> all;
    void add(const point_cloud<float, 3>& cloud) { all.push_back(cloud.size()); }
  } seen;
  frames | accumulate_into(seen);
  CHECK(seen.all == std::vector<index_t>{100, 110, 120, 130});
}

TEST_CASE("a cloud that frames cannot be appended to is as it was") {
  auto frames = some_frames();
  frames[2].colors = Eigen::Matrix3Xf::Zero(3, frames[2].size());
  auto map = frames[0];
  CHECK_THROWS_AS(frames | accumulate_into(map), invalid_input);
  CHECK(map == frames[0]);
  CHECK(append_all(std::vector<point_cloud<float, 3>>{}).empty());
}

TEST_CASE("appending many clouds is appending one after the other, wherever they lie") {
  std::vector<point_cloud<float, 3>> clouds = some_frames();
  clouds[1].origin = {100, 0, 0};
  clouds[3].comments = {"the last"};
  clouds.push_back({});
  for (auto& cloud : clouds) cloud.set_attribute("id", std::vector<int>(std::size_t(cloud.size())));
  point_cloud<float, 3> one_by_one;
  for (const auto& cloud : clouds) one_by_one = append(std::move(one_by_one), cloud);
  CHECK(append_all(clouds) == one_by_one);
  CHECK(one_by_one.points(0, 100) == clouds[1].points(0, 0) + 100);
  // Also of a cloud with itself.
  CHECK(append(clouds[0], clouds[0]).attribute_as<int>("id").size() == 200);
}
