// SPDX-License-Identifier: MIT
#include <cstdint>
#include <vector>

#include "spaces.hpp"

import cilantro;
import test_support;

using namespace cilantro;

TEST_CASE("clusters come by descending size, then smallest index, with members ascending") {
  const clusters found{std::vector<std::int32_t>{5, -1, 2, 2, 7, 5, 7, -3, 7, 0}};
  REQUIRE(found.size() == 4);
  CHECK(found.sizes() == std::vector<index_t>{3, 2, 2, 1});
  const auto members = [&](index_t c) {
    return std::vector<std::int32_t>(found[c].begin(), found[c].end());
  };
  CHECK(members(0) == std::vector<std::int32_t>{4, 6, 8});
  CHECK(members(1) == std::vector<std::int32_t>{0, 5});
  CHECK(members(2) == std::vector<std::int32_t>{2, 3});
  CHECK(members(3) == std::vector<std::int32_t>{9});
  CHECK(std::vector<std::int32_t>(found.labels().begin(), found.labels().end()) ==
        std::vector<std::int32_t>{1, -1, 2, 2, 0, 1, 0, -1, 0, 3});
  CHECK(found.unlabeled() == 2);
  index_t total = 0;
  for (const auto cluster : found) total += std::ssize(cluster);
  CHECK(total == 8);
}

TEST_CASE("without points there are no clusters, and a label beyond them is refused") {
  CHECK(clusters{}.size() == 0);
  CHECK(clusters{std::vector<std::int32_t>{}}.empty());
  CHECK(clusters{std::vector<std::int32_t>{-1, -1}}.unlabeled() == 2);
  CHECK_THROWS_AS((void)clusters(std::vector<std::int32_t>{0, 2}), invalid_input);
}

TEST_CASE("labels have colours that differ from their neighbours and from grey") {
  std::vector<std::int32_t> labels{-1};
  for (std::int32_t l = 0; l < 50; ++l) labels.push_back(l);
  const auto colors = label_colors(labels);
  CHECK(colors.minCoeff() >= 0);
  CHECK(colors.maxCoeff() <= 1);
  for (index_t i = 1; i < colors.cols(); ++i)
    CHECK((colors.col(i) - colors.col(i - 1)).norm() > 0.3);
}
