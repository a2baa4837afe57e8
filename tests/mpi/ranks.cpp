// SPDX-License-Identifier: MIT
//
// What one rank does; started several times by on_ranks.sh. See CMakeLists.txt for what there is.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

import cilantro;
import cilantro.mpi;
import rank_support;
import test_support;

using namespace cilantro;

namespace {

/// All that ranks can do, with the hash that threads have.
void check(mpi::communicator& ranks) {
  // Above what is gathered at once.
  const std::size_t most = (std::size_t{200} << 20) / std::size_t(ranks.size());
  const auto hash = test::check_ranks(ranks, most);
  std::uint64_t expected = 0;
  if (ranks.rank() == 0)
    test::in_process_ranks{ranks.size()}.run([&](auto& rank) {
      const auto of_threads = test::check_ranks(rank, most);
      if (rank.rank() == 0) expected = of_threads;
    });
  test::require(ranks.rank() != 0 || hash == expected, "processes and threads have the same");
  if (ranks.rank() == 0) std::cout << "the same for " << ranks.size() << " ranks\n";
}

/// What all points of a survey decide together, in one list.
std::vector<double> all_decided(const tiled_cloud<float, 3>& survey,
                                const tiled_cloud<float, 3>& target) {
  std::vector<double> found;
  const auto add = [&](const auto& matrix) {
    for (const auto value : matrix.reshaped()) found.push_back(double(value));
  };
  const auto moments = mean_and_covariance(survey);
  add(moments->mean);
  add(moments->covariance);
  for (const box bounds = *bounds_of(survey | voxel_downsample(0.7)); int d : {0, 1, 2})
    found.insert(found.end(), {bounds.lower[d], bounds.upper[d]});
  const auto apart = compare(survey, target, {.max_distance = 3});
  found.insert(found.end(), {double(apart.pairs), apart.mean, apart.rmse, apart.maximum});
  const auto changes =
      *statistics_of(survey | distances_to(target, {.max_distance = 3}), "distance");
  found.insert(found.end(), {changes.least, changes.most, changes.mean, changes.deviation});
  const auto aligned = align(survey, target, {.metric = point_to_point{}, .max_distance = 2});
  add(aligned.transform.matrix());
  found.insert(found.end(), {aligned.rmse, double(aligned.iterations)});
  const auto parts = kmeans(survey, 5, {.max_iterations = 8, .seed = 3});
  add(parts.centroids);
  found.push_back(parts.inertia);
  const auto plane = ransac_hyperplane(survey, {.max_residual = 0.5, .seed = 2});
  add(plane->model.normal);
  found.insert(found.end(), {plane->model.offset, double(plane->inliers)});
  return found;
}

/// Hills, for ranks to share.
point_cloud<float, 3> hills(index_t n, std::uint64_t seed) {
  point_cloud<float, 3> cloud;
  cloud.points.resize(3, n);
  for (index_t i = 0; i < n; ++i) {
    random_stream random{seed, std::uint64_t(i)};
    const double x = random.uniform(-30, 70), y = random.uniform(-40, 20);
    cloud.points.col(i) << float(x), float(y), float(std::sin(0.1 * x) + std::cos(0.2 * y));
  }
  return cloud;
}

/// Ranks find of a survey, and write of it, what one process does.
void survey(mpi::communicator& ranks) {
  // All have the folder of rank 0.
  std::optional<test::temporary_folder> own;
  if (ranks.rank() == 0) {
    own.emplace();
    write_ply(hills(9000, 1), *own / "hills.ply");
    write_ply(hills(7000, 2), *own / "other.ply");
  }
  const auto name = own ? (*own / "").string() : std::string{};
  const auto given = ranks.all_gather(std::as_bytes(std::span{name})).front();
  std::filesystem::path folder;
  folder = std::string{reinterpret_cast<const char*>(given.data()), given.size()};

  const auto open = [&](const char* file) {
    return open_tiles<float>(folder / file, {.edge = 11, .threads = 2});
  };
  const auto found = all_decided(open("hills.ply").on(ranks), open("other.ply").on(ranks));
  const auto expected = all_decided(open("hills.ply"), open("other.ply"));
  test::require(found == expected, "a survey is for ranks what it is for one process");

  const auto write = [](const tiled_cloud<float, 3>& cloud, const std::filesystem::path& to) {
    (void)(cloud | voxel_downsample(0.3) | estimate_normals(knn{8}) |
           remove_statistical_outliers({.neighbors = 8}) | write_tiles(to));
  };
  write(open("hills.ply").on(ranks), folder / "of_ranks");
  if (ranks.rank() == 0) {
    write(open("hills.ply"), folder / "of_one");
    for (const auto& entry : std::filesystem::directory_iterator{folder / "of_one"}) {
      const auto content = [](const std::filesystem::path& file) {
        std::ifstream in{file, std::ios::binary};
        return std::string{std::istreambuf_iterator{in}, {}};
      };
      test::require(content(entry) == content(folder / "of_ranks" / entry.path().filename()),
                    "ranks write the tiles that one process writes");
    }
  }
  (void)ranks.all_gather({});
  if (ranks.rank() == 0) std::cout << "the same survey for " << ranks.size() << " ranks\n";
}

/// What rank 1 does while the others wait for it.
void misbehave(const std::string& how, mpi::communicator& ranks) {
  if (how == "throws" || how == "throws_to_nobody") throw std::runtime_error{"no such tile"};
  if (how == "exits") std::exit(0);
  if (how == "aborts") std::abort();
  if (how == "is_killed") std::raise(SIGKILL);
  if (how == "stands_still") {
    std::raise(SIGSTOP);
    return;
  }
  if (how == "deals_otherwise") ranks.deal(2);
  if (how == "leaves_early") return;
  throw std::invalid_argument{how};
}

/// Ten seconds of work for four ranks, of which the first says what each has done.
void work(mpi::communicator& ranks) {
  ranks.deal(400);
  int done = 0;
  for (; ranks.next_ticket(); ++done) std::this_thread::sleep_for(std::chrono::milliseconds{100});
  for (const auto& theirs : ranks.all_gather(std::as_bytes(std::span{&done, 1}))) {
    std::ranges::copy(theirs, std::as_writable_bytes(std::span{&done, 1}).begin());
    if (ranks.rank() == 0) std::cout << done << " tickets\n";
  }
}

void run(const std::string& how, int& argc, char**& argv) {
  double patience = how == "stands_still" ? 2 : 60;
  if (argc > 2) patience = std::stod(argv[2]);
  mpi::communicator ranks{argc, argv, {.patience = patience}};
  if (how == "works") return work(ranks);
  if (how == "check") return check(ranks);
  if (how == "survey") return survey(ranks);
  if (how == "second") {
    try {
      mpi::communicator second{argc, argv};
    } catch (const invalid_input& what) {
      if (ranks.rank() == 0) std::cout << what.what() << '\n';
    }
    return;
  }
  if (ranks.rank() == 1) return misbehave(how, ranks);
  if (how == "deals_otherwise") return ranks.deal(1);
  ranks.deal(10);
  while (ranks.next_ticket()) continue;
  (void)ranks.all_gather({});
}

}  // namespace

int main(int argc, char** argv) {
  const std::string how = argc > 1 ? argv[1] : "";
  if (how == "throws_to_nobody") run(how, argc, argv);
  try {
    run(how, argc, argv);
  } catch (const std::exception& what) {
    std::cerr << "main: " << what.what() << '\n';
    return 1;
  }
}
