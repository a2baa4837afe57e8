// SPDX-License-Identifier: MIT
#include <doctest/doctest.h>
#include <algorithm>
#include <array>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

import cilantro;
import test_support;
using namespace cilantro;

namespace {

using cloud = point_cloud<double, 3>;

/// Texts of enough rows that several threads read them, in lines of different lengths.
point_cloud<float, 3> example(index_t n) {
  point_cloud<float, 3> all;
  all.points.resize(3, n);
  all.colors.resize(3, n);
  for (index_t i = 0; i < n; ++i) {
    random_stream random{7, std::uint64_t(i)};
    for (index_t d = 0; d < 3; ++d) {
      all.points(d, i) = i % 3 == 0 ? float(random.below(9)) : float(random.normal());
      all.colors(d, i) = float(random.below(256)) / 255;
    }
  }
  return all;
}

std::string content_of(const std::filesystem::path& path) {
  std::ifstream file{path, std::ios::binary};
  return {std::istreambuf_iterator<char>{file}, {}};
}

struct text {
  std::string name, content;
  std::string newline = "\n";
};

/// The same points in each format that is a text, and with each end of line.
std::vector<text> texts(index_t n) {
  const test::temporary_folder folder;
  const auto points = example(n);
  write_text(points, folder / "a.xyz");
  write_text(points, folder / "a.csv", {.separator = ';', .names = false});
  write_pts(points, folder / "a.pts");
  write_ply(points, folder / "a.ply",
            {.format = ply_format::ascii, .triangles = Eigen::MatrixXi::Ones(3, 5)});
  write_pcd(points, folder / "a.pcd", {.format = pcd_format::ascii});
  std::vector<text> all;
  for (const char* name : {"a.xyz", "a.csv", "a.pts", "a.ply", "a.pcd"}) {
    all.push_back({name, content_of(folder / name)});
    for (const char* newline : {"\r\n", "\r"}) {
      all.push_back({name, {}, newline});
      for (const char c : all[all.size() - 1 - (newline[1] ? 1 : 2)].content)
        c == '\n' ? void(all.back().content += newline) : all.back().content.push_back(c);
    }
  }
  std::string decimal = all[3].content;
  std::ranges::replace(decimal, '.', ',');
  all.push_back({"decimal.csv", decimal});
  return all;
}

/// What reading gives, or says.
std::pair<std::optional<cloud>, std::string> outcome(const text& file, int threads) {
  const auto bytes = std::as_bytes(std::span{file.content});
  try {
    if (file.name.ends_with("ply"))
      return {read_ply<double>(bytes, file.name, {.threads = threads}), {}};
    if (file.name.ends_with("pcd"))
      return {read_pcd<double>(bytes, file.name, {.threads = threads}), {}};
    return {read_text<double>(bytes, file.name, {.threads = threads}), {}};
  } catch (const io_error& error) {
    return {{}, error.what()};
  }
}

void check_all_threads(const text& file) {
  const auto expected = outcome(file, 1);
  for (const int threads : {2, 5}) {
    const auto found = outcome(file, threads);
    CHECK(found.second == expected.second);
    CHECK((found.first == expected.first));
  }
}

/// Where line `i` begins.
std::size_t line_begin(const text& file, int i) {
  std::size_t at = 0;
  for (; i > 0; --i) at = file.content.find(file.newline, at) + file.newline.size();
  return at;
}

}  // namespace

TEST_CASE("texts are the same clouds for any number of threads") {
  for (const auto& file : texts(30'000)) {
    INFO(file.name);
    const auto [found, error] = outcome(file, 1);
    CHECK(error == "");
    REQUIRE(found);
    CHECK(found->size() == 30'000);
    check_all_threads(file);
  }
}

TEST_CASE("blank lines and comments among the rows are passed over by any number of threads") {
  for (auto& file : texts(30'000)) {
    INFO(file.name);
    for (const int line : {29'000, 28'999, 15'000, 9000, 100}) {
      file.content.insert(line_begin(file, line), file.newline + " \t" + file.newline);
      if (!file.name.ends_with("ply") && line != 15'000)
        file.content.insert(line_begin(file, line), "# a comment" + file.newline);
    }
    CHECK(outcome(file, 1).second == "");
    check_all_threads(file);
  }
}

TEST_CASE("the first line that is wrong is named by any number of threads") {
  for (const auto& file : texts(30'000)) {
    INFO(file.name);
    for (const int line : {40, 4000, 12'345, 29'990})
      for (const char* wrong : {"1 2 x 4 5 6", "1 2", "1 2 3 4 5 6 7 8 9", "3 3 3 1000 3 3"}) {
        auto bad = file;
        bad.content.insert(line_begin(bad, line), wrong + bad.newline);
        // Not the first: it must not be the one that is named.
        bad.content.insert(line_begin(bad, 29'995), wrong + bad.newline);
        check_all_threads(bad);
      }
    auto shorter = file;
    shorter.content.resize(line_begin(shorter, 25'000) + 5);
    check_all_threads(shorter);
  }
}

TEST_CASE("texts with errors anywhere have the same outcome for any number of threads") {
  const auto files = texts(12'000);
  constexpr std::string_view alphabet = "0123456789.,;+-eE# /\t\r\nxnai\"";
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    random_stream random{seed};
    auto file = files[std::size_t(random.below(std::ssize(files)))];
    for (index_t i = random.below(4); i >= 0; --i)
      file.content[std::size_t(random.below(std::ssize(file.content)))] =
          alphabet[std::size_t(random.below(std::ssize(alphabet)))];
    INFO(seed << ' ' << file.name);
    check_all_threads(file);
  }
}

TEST_CASE("a line longer than what threads take at a time is read") {
  for (auto& file : texts(20'000)) {
    if (file.name.ends_with("ply") || file.name.ends_with("pcd")) continue;
    INFO(file.name);
    file.content.insert(line_begin(file, 15'000), "#" + std::string(9'000'000, 'x') + file.newline);
    CHECK(outcome(file, 1).second == "");
    check_all_threads(file);
  }
}

TEST_CASE("pieces of a text that several threads read are the whole") {
  const test::temporary_folder folder;
  for (const auto& file : texts(20'000)) {
    INFO(file.name);
    std::ofstream{folder / file.name, std::ios::binary} << file.content;
    const auto whole = read_cloud<double>(folder / file.name, {.threads = 1});
    for (const index_t piece : {4500, 7000, 20'000}) {
      cloud_reader<double> reader{folder / file.name, {.threads = 3}};
      cloud all;
      for (auto next = reader.read(piece); !next.empty(); next = reader.read(piece))
        all = all.empty() ? std::move(next) : append(std::move(all), next);
      CHECK(all == whole);
    }
  }
}

TEST_CASE("a negative number of threads is refused where a text is read") {
  const auto file = texts(5000).front();
  CHECK_THROWS_AS((void)outcome(file, -1), invalid_input);
}
