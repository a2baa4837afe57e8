// SPDX-License-Identifier: MIT
//
// Steps of a pipeline from words like voxel=0.005 or normals=knn:10.
module;
#include <charconv>
#include <cstdint>
#include <functional>
#include <map>
#include <stdexcept>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <variant>
#include <vector>
export module steps;

import cilantro;
import tool;
using namespace cilantro;

/// A step that has its name and arguments; what remains is the cloud and how to work on it.
export struct tool_step {
  std::function<tool_cloud(tool_cloud&&, const execution&)> on_cloud;
  std::function<tool_tiles(const tool_tiles&, const execution&)> on_tiles;
};

/// What follows the = of a step, in parts.
class arguments {
 public:
  arguments(std::string step, std::string_view text) : step_{std::move(step)} {
    while (!text.empty()) {
      const auto end = text.find(':');
      parts_.emplace_back(text.substr(0, end));
      text.remove_prefix(end == text.npos ? text.size() : end + 1);
    }
  }

  [[nodiscard]] std::size_t size() const { return parts_.size(); }
  void expect_size(std::size_t least, std::size_t most, const char* form) const {
    if (parts_.size() < least || parts_.size() > most)
      throw std::invalid_argument{"the step \"" + step_ + "\" is written " + form};
  }
  [[nodiscard]] const std::string& word(std::size_t i) const { return parts_[i]; }
  [[nodiscard]] double number(std::size_t i) const { return parse<double>(i); }
  [[nodiscard]] index_t count(std::size_t i) const { return parse<std::int64_t>(i); }

  /// knn:K, radius:R or knn_in_radius:K:R, from part `first` on.
  [[nodiscard]] neighborhood_spec neighborhood(std::size_t first, const char* form) const {
    if (size() <= first)
      throw std::invalid_argument{"the step \"" + step_ + "\" is written " + form};
    if (word(first) == "knn" && size() == first + 2) return knn{count(first + 1)};
    if (word(first) == "radius" && size() == first + 2) return radius{number(first + 1)};
    if (word(first) == "knn_in_radius" && size() == first + 3)
      return knn_in_radius{count(first + 1), number(first + 2)};
    throw std::invalid_argument{"the step \"" + step_ + "\" is written " + form};
  }

 private:
  template <class T>
  [[nodiscard]] T parse(std::size_t i) const {
    T value{};
    const auto& text = parts_[i];
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc{} || end != text.data() + text.size())
      throw std::invalid_argument{"\"" + text + "\" in the step \"" + step_ + "\" is no number"};
    return value;
  }

  std::string step_;
  std::vector<std::string> parts_;
};

/// The step of the library that `make(how)` gives, on clouds of either precision.
template <class Make>
tool_step step_made_by(Make make) {
  return {[make](tool_cloud&& cloud, const execution& how) {
            return std::visit([&](auto&& c) -> tool_cloud { return std::move(c) | make(how); },
                              std::move(cloud));
          },
          [make](const tool_tiles& tiles, const execution& how) { return tiles | make(how); }};
}
template <class Step>
tool_step always(Step step) {
  return step_made_by([step](const execution&) { return step; });
}

using maker = std::function<tool_step(const arguments&)>;

const std::map<std::string, std::pair<const char*, maker>, std::less<>> makers{
    {"invalid",
     {"invalid: remove points that are not finite",
      [](const arguments& a) {
        a.expect_size(0, 0, "invalid");
        return always(remove_invalid());
      }}},
    {"crop",
     {"crop=X:Y:Z:X:Y:Z: keep what is in a box, from its least corner to its greatest",
      [](const arguments& a) {
        a.expect_size(6, 6, "crop=X:Y:Z:X:Y:Z");
        return always(crop(box{.lower = {a.number(0), a.number(1), a.number(2)},
                               .upper = {a.number(3), a.number(4), a.number(5)}}));
      }}},
    {"voxel",
     {"voxel=EDGE: one point for each cell of a grid",
      [](const arguments& a) {
        a.expect_size(1, 1, "voxel=EDGE");
        return step_made_by([edge = a.number(0)](const execution& how) {
          return voxel_downsample(edge, {.threads = how.threads, .monitor = how.monitor});
        });
      }}},
    {"normals",
     {"normals=knn:K, radius:R or knn_in_radius:K:R: normals and curvature",
      [](const arguments& a) {
        const auto spec = a.neighborhood(0, "normals=knn:K, radius:R or knn_in_radius:K:R");
        return step_made_by([spec](const execution& how) {
          return estimate_normals(spec, {.threads = how.threads, .monitor = how.monitor});
        });
      }}},
    {"viewpoint",
     {"viewpoint=X:Y:Z: turn normals towards a place",
      [](const arguments& a) {
        a.expect_size(3, 3, "viewpoint=X:Y:Z");
        return always(orient_to_viewpoint({a.number(0), a.number(1), a.number(2)}));
      }}},
    {"orient",
     {"orient=knn:K or radius:R: turn normals so that neighbours agree",
      [](const arguments& a) {
        return always(orient_consistently(a.neighborhood(0, "orient=knn:K or radius:R")));
      }}},
    {"outliers",
     {"outliers=K:DEVIATIONS: remove points that are far from their K nearest",
      [](const arguments& a) {
        a.expect_size(2, 2, "outliers=K:DEVIATIONS");
        return step_made_by([k = a.count(0), deviations = a.number(1)](const execution& how) {
          return remove_statistical_outliers({.neighbors = k,
                                              .deviations = deviations,
                                              .threads = how.threads,
                                              .monitor = how.monitor});
        });
      }}},
    {"lonely",
     {"lonely=RADIUS:LEAST: remove points with fewer than LEAST others within a radius",
      [](const arguments& a) {
        a.expect_size(2, 2, "lonely=RADIUS:LEAST");
        return step_made_by([r = a.number(0), least = a.count(1)](const execution& how) {
          return remove_radius_outliers({.radius = r,
                                         .min_neighbors = least,
                                         .threads = how.threads,
                                         .monitor = how.monitor});
        });
      }}},
    {"random",
     {"random=COUNT or COUNT:SEED: keep some points, drawn at random",
      [](const arguments& a) {
        a.expect_size(1, 2, "random=COUNT or random=COUNT:SEED");
        const auto seed = static_cast<std::uint64_t>(a.size() > 1 ? a.count(1) : 0);
        return always(random_sample(a.count(0), {.seed = seed}));
      }}},
    {"uniform",
     {"uniform=COUNT: keep some points, at equal steps",
      [](const arguments& a) {
        a.expect_size(1, 1, "uniform=COUNT");
        return always(uniform_sample(a.count(0)));
      }}},
    {"farthest",
     {"farthest=COUNT: keep some points, each the farthest from those before",
      [](const arguments& a) {
        a.expect_size(1, 1, "farthest=COUNT");
        return step_made_by([n = a.count(0)](const execution& how) {
          return farthest_point_sample(n, {.threads = how.threads, .monitor = how.monitor});
        });
      }}},
    {"take",
     {"take=COUNT: keep the first points",
      [](const arguments& a) {
        a.expect_size(1, 1, "take=COUNT");
        return always(take(a.count(0)));
      }}},
    {"stride",
     {"stride=N: keep every N-th point",
      [](const arguments& a) {
        a.expect_size(1, 1, "stride=N");
        return always(stride(a.count(0)));
      }}},
};

/// The step that `text` says. Throws `std::invalid_argument` in a sentence if it says none.
export tool_step parse_step(const std::string& text) {
  const auto equals = text.find('=');
  const std::string name = text.substr(0, equals);
  const auto found = makers.find(name);
  if (found == makers.end())
    throw std::invalid_argument{"there is no step \"" + name + "\"; --help lists them"};
  return found->second.second(
      {name, equals == text.npos ? std::string_view{} : std::string_view{text}.substr(equals + 1)});
}

/// A line for each step there is.
export std::string known_steps() {
  std::string text = "STEPS, in the order in which they are done:\n";
  for (const auto& [name, step] : makers) text += std::string{"  "} + step.first + '\n';
  return text;
}
