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
export using tool_step = std::function<tool_cloud(tool_cloud&&, const execution&)>;

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

/// The step that `work` does on clouds of either precision.
template <class Work>
tool_step on_clouds(Work work) {
  return [work](tool_cloud&& cloud, const execution& how) {
    return std::visit([&](auto&& c) -> tool_cloud { return work(std::move(c), how); },
                      std::move(cloud));
  };
}

using maker = std::function<tool_step(const arguments&)>;

const std::map<std::string, std::pair<const char*, maker>, std::less<>> makers{
    {"invalid",
     {"invalid: remove points that are not finite",
      [](const arguments& a) -> tool_step {
        a.expect_size(0, 0, "invalid");
        return on_clouds([](auto&& c, const execution&) { return remove_invalid(std::move(c)); });
      }}},
    {"voxel",
     {"voxel=EDGE: one point for each cell of a grid",
      [](const arguments& a) -> tool_step {
        a.expect_size(1, 1, "voxel=EDGE");
        return on_clouds([edge = a.number(0)](auto&& c, const execution& how) {
          return voxel_downsample(c, edge, {.threads = how.threads, .monitor = how.monitor});
        });
      }}},
    {"normals",
     {"normals=knn:K, radius:R or knn_in_radius:K:R: normals and curvature",
      [](const arguments& a) -> tool_step {
        const auto spec = a.neighborhood(0, "normals=knn:K, radius:R or knn_in_radius:K:R");
        return on_clouds([spec](auto&& c, const execution& how) {
          return estimate_normals(std::move(c), spec,
                                  {.threads = how.threads, .monitor = how.monitor});
        });
      }}},
    {"viewpoint",
     {"viewpoint=X:Y:Z: turn normals towards a place",
      [](const arguments& a) -> tool_step {
        a.expect_size(3, 3, "viewpoint=X:Y:Z");
        const coordinates eye{a.number(0), a.number(1), a.number(2)};
        return on_clouds(
            [eye](auto&& c, const execution&) { return orient_to_viewpoint(std::move(c), eye); });
      }}},
    {"orient",
     {"orient=knn:K or radius:R: turn normals so that neighbours agree",
      [](const arguments& a) -> tool_step {
        const auto spec = a.neighborhood(0, "orient=knn:K or radius:R");
        return on_clouds(
            [spec](auto&& c, const execution&) { return orient_consistently(std::move(c), spec); });
      }}},
    {"outliers",
     {"outliers=K:DEVIATIONS: remove points that are far from their K nearest",
      [](const arguments& a) -> tool_step {
        a.expect_size(2, 2, "outliers=K:DEVIATIONS");
        return on_clouds(
            [k = a.count(0), deviations = a.number(1)](auto&& c, const execution& how) {
              return remove_statistical_outliers(c, {k, deviations, how.threads, how.monitor});
            });
      }}},
    {"lonely",
     {"lonely=RADIUS:LEAST: remove points with fewer than LEAST others within a radius",
      [](const arguments& a) -> tool_step {
        a.expect_size(2, 2, "lonely=RADIUS:LEAST");
        return on_clouds([r = a.number(0), least = a.count(1)](auto&& c, const execution& how) {
          return remove_radius_outliers(c, {r, least, how.threads, how.monitor});
        });
      }}},
    {"random",
     {"random=COUNT or COUNT:SEED: keep some points, drawn at random",
      [](const arguments& a) -> tool_step {
        a.expect_size(1, 2, "random=COUNT or random=COUNT:SEED");
        const auto seed = static_cast<std::uint64_t>(a.size() > 1 ? a.count(1) : 0);
        return on_clouds([n = a.count(0), seed](auto&& c, const execution&) {
          return random_sample(c, n, seed);
        });
      }}},
    {"uniform",
     {"uniform=COUNT: keep some points, at equal steps",
      [](const arguments& a) -> tool_step {
        a.expect_size(1, 1, "uniform=COUNT");
        return on_clouds(
            [n = a.count(0)](auto&& c, const execution&) { return uniform_sample(c, n); });
      }}},
    {"farthest",
     {"farthest=COUNT: keep some points, each the farthest from those before",
      [](const arguments& a) -> tool_step {
        a.expect_size(1, 1, "farthest=COUNT");
        return on_clouds([n = a.count(0)](auto&& c, const execution& how) {
          return farthest_point_sample(c, n, {.threads = how.threads, .monitor = how.monitor});
        });
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
