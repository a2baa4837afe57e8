// SPDX-License-Identifier: MIT
//
// What a job of many ranks would take for a survey: what tiles take here, dealt to ranks of sixteen
// threads as `mpi::communicator` does, and as often as larger surveys have such tiles.
//
//   dealing FILES MEMORY_MB [MILLISECONDS_OF_A_QUESTION [MICROSECONDS_OF_AN_ANSWER]]
//
// Each tile is sent through the steps alone, on one thread, and timed by the processor time that it
// takes. A rank asks for one tile at a time, which takes the first, and rank 0 answers one question
// after the other, which takes the second. Not in the model: what threads of a machine share, and a
// file system that is slower than the ranks together ask for, which the last column tells.
#include <time.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <fstream>
#include <functional>
#include <iostream>
#include <queue>
#include <string>
#include <utility>
#include <vector>

import cilantro;
using namespace cilantro;

namespace {

struct tile_cost {
  double points = 0, seconds = 0;
};

double processor_seconds() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return double(now.tv_sec) + double(now.tv_nsec) * 1e-9;
}

double bytes_read() {
  std::ifstream in{"/proc/self/io"};
  std::string word;
  double bytes = 0;
  in >> word >> bytes;
  return bytes;
}

std::vector<tile_cost> measure(const tiled_cloud<float>& survey) {
  std::vector<tile_cost> costs;
  const auto result = survey | voxel_downsample(0.4) | estimate_normals(knn{10});
  double before = processor_seconds();
  for_each_tile(result, halo{0}, [&](const tile<float, 3>& t) {
    const double now = processor_seconds();
    costs.push_back({double(t.info.points), now - before});
    before = now;
  });
  return costs;
}

/// seconds = fixed + per_point · points, with the least squares, and how far off that is.
struct cost_model {
  double fixed = 0, per_point = 0, deviation = 0;
};

cost_model fit(const std::vector<tile_cost>& costs) {
  const double n = double(costs.size());
  double points = 0, seconds = 0, squares = 0, products = 0;
  for (const auto& tile : costs) {
    points += tile.points / n;
    seconds += tile.seconds / n;
  }
  for (const auto& tile : costs) {
    squares += (tile.points - points) * (tile.points - points);
    products += (tile.points - points) * (tile.seconds - seconds);
  }
  cost_model model;
  model.per_point = squares > 0 ? products / squares : 0;
  model.fixed = seconds - model.per_point * points;
  for (const auto& tile : costs) {
    const double off = model.fixed + model.per_point * tile.points - tile.seconds;
    model.deviation += off * off / n;
  }
  model.deviation = std::sqrt(model.deviation);
  return model;
}

struct dealing_times {
  double question = 0, answer = 0;  ///< In seconds.
};

/// When the last thread is done, if each takes the next tile when it is free.
double span_of(const std::vector<double>& tiles, int ranks, int threads, dealing_times times) {
  using earliest_first = std::greater<>;
  using arrival = std::pair<double, int>;  // Of the question of a rank.
  std::priority_queue<arrival, std::vector<arrival>, earliest_first> questions;
  std::vector<std::priority_queue<double, std::vector<double>, earliest_first>> free(ranks);
  const auto ask = [&](int rank, double may_ask) {
    questions.push({std::max(free[rank].top(), may_ask) + times.question / 2, rank});
    free[rank].pop();
  };
  for (int rank = 0; rank < ranks; ++rank) {
    for (int t = 0; t < threads; ++t) free[rank].push(0);
    ask(rank, 0);
  }
  double dealer = 0, span = 0;
  for (const double seconds : tiles) {
    const auto [arrived, rank] = questions.top();
    questions.pop();
    dealer = std::max(dealer, arrived) + times.answer;
    const double begin = dealer + times.question / 2;
    free[rank].push(begin + seconds);
    span = std::max(span, begin + seconds);
    ask(rank, begin);
  }
  return span;
}

/// The costs of a survey with so many times as many tiles of the same kinds, the largest first.
std::vector<double> enlarged(std::vector<tile_cost> costs, std::int64_t times) {
  std::ranges::sort(costs, std::greater{}, &tile_cost::points);
  std::vector<double> tiles;
  tiles.reserve(costs.size() * static_cast<std::size_t>(times));
  for (const auto& tile : costs) tiles.insert(tiles.end(), times, tile.seconds);
  return tiles;
}

int run(int argc, char** argv) {
  if (argc < 3) {
    std::cerr << "usage: the head of benchmarks/dealing.cpp\n";
    return 2;
  }
  const dealing_times times{.question = (argc > 3 ? std::atof(argv[3]) : 3) * 1e-3,
                            .answer = (argc > 4 ? std::atof(argv[4]) : 20) * 1e-6};
  const auto survey = open_tiles<float>(
      argv[1], {.memory = std::strtoull(argv[2], nullptr, 10) * 1'000'000, .threads = 1});
  const double read_before = bytes_read();
  const auto costs = measure(survey);
  const cost_model model = fit(costs);
  double seconds = 0, points = 0;
  for (const auto& tile : costs) {
    seconds += tile.seconds;
    points += tile.points;
  }
  const double bytes = (bytes_read() - read_before) / points;
  std::printf(
      "%zu tiles of %g m, %.0f points, %.1f s of one processor, %.0f bytes read a point\n"
      "a tile takes %.1f ms + %.3f us a point, give or take %.1f ms\n\n",
      costs.size(), survey.edge(), points, seconds, bytes, model.fixed * 1e3, model.per_point * 1e6,
      model.deviation * 1e3);

  constexpr int threads = 16;
  std::printf("%8s %6s %9s %9s %9s %11s %10s\n", "points", "ranks", "tiles", "seconds", "of ideal",
              "points/s", "GB/s read");
  for (const double wanted : {1e9, 1e10, 1e11})
    for (const int ranks : {1, 10, 100, 1000}) {
      const auto copies = static_cast<std::int64_t>(std::ceil(wanted / points));
      const auto tiles = enlarged(costs, copies);
      const double span = span_of(tiles, ranks, threads, times);
      const double ideal = seconds * double(copies) / (ranks * threads),
                   speed = points * double(copies) / span;
      std::printf("%8.0e %6d %9zu %9.1f %8.1f%% %11.2e %10.2f\n", wanted, ranks, tiles.size(), span,
                  100 * ideal / span, speed, speed * bytes * 1e-9);
    }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const std::exception& error) {
    std::cerr << error.what() << '\n';
    return 1;
  }
}
