// SPDX-License-Identifier: MIT
module;
#include "core/closed_spaces.hpp"
module cilantro.clustering;

namespace cilantro {
namespace {

/// How many points have each label, and each pair of labels.
struct contingency {
  std::map<std::int32_t, double> a, b;
  std::map<std::pair<std::int32_t, std::int32_t>, double> both;
  double total;

  contingency(std::span<const std::int32_t> first, std::span<const std::int32_t> second)
      : total{double(first.size())} {
    expects(first.size() == second.size(), "both labelings must have the same number of labels");
    for (std::size_t i = 0; i < first.size(); ++i) {
      ++a[first[i]];
      ++b[second[i]];
      ++both[{first[i], second[i]}];
    }
  }
};

template <class Counts>
double pairs_within(const Counts& counts) {
  double sum = 0;
  for (const auto& [label, n] : counts) sum += n * (n - 1) / 2;
  return sum;
}

double entropy(const std::map<std::int32_t, double>& counts, double total) {
  double sum = 0;
  for (const auto& [label, n] : counts) sum -= n / total * std::log(n / total);
  return sum;
}

}  // namespace

double adjusted_rand_index(std::span<const std::int32_t> a, std::span<const std::int32_t> b) {
  const contingency table{a, b};
  const double in_a = pairs_within(table.a), in_b = pairs_within(table.b);
  const double all = table.total * (table.total - 1) / 2;
  const double by_chance = all > 0 ? in_a * in_b / all : 0, most = (in_a + in_b) / 2;
  return most == by_chance ? 1 : (pairs_within(table.both) - by_chance) / (most - by_chance);
}

double normalized_mutual_information(std::span<const std::int32_t> a,
                                     std::span<const std::int32_t> b) {
  const contingency table{a, b};
  const double mean = (entropy(table.a, table.total) + entropy(table.b, table.total)) / 2;
  if (!(mean > 0)) return 1;
  double information = 0;
  for (const auto& [labels, n] : table.both)
    information +=
        n / table.total *
        std::log(n * table.total / (table.a.at(labels.first) * table.b.at(labels.second)));
  return std::clamp(information / mean, 0.0, 1.0);
}

template <Scalar S, int D>
std::vector<double> closed_silhouettes(points_view<S, D> points,
                                       std::span<const std::int32_t> labels, const execution& how) {
  expects(std::ssize(labels) == points.size(), "silhouette: there must be one label per point");
  std::vector<clusters::label> counted(labels.begin(), labels.end());
  for (index_t i = 0; i < points.size(); ++i)
    if (!is_finite(points[i])) counted[i] = clusters::none;
  const clusters groups{std::move(counted)};

  std::vector<double> values(labels.size());
  parallel_blocks(points.size(), 64, how, [&](index_t, index_t begin, index_t end) {
    for (index_t i = begin; i < end; ++i) {
      const auto own = groups.labels()[i];
      if (own < 0 || groups.size() < 2 || groups[own].size() < 2) continue;
      const Eigen::VectorXd p = points[i].template cast<double>();
      double inside = 0, outside = std::numeric_limits<double>::infinity();
      for (index_t c = 0; c < groups.size(); ++c) {
        double sum = 0;
        for (const auto j : groups[c]) sum += (points[j].template cast<double>() - p).norm();
        if (c == own)
          inside = sum / double(groups[c].size() - 1);
        else
          outside = std::min(outside, sum / double(groups[c].size()));
      }
      const double larger = std::max(inside, outside);
      values[i] = larger > 0 ? (outside - inside) / larger : 0;
    }
  });
  return values;
}

#define CILANTRO_INSTANTIATE(S, D)                 \
  template std::vector<double> closed_silhouettes( \
      points_view<S, D>, std::span<const std::int32_t>, const execution&);
CILANTRO_FOR_CLOSED_SPACES(CILANTRO_INSTANTIATE)
#undef CILANTRO_INSTANTIATE

}  // namespace cilantro
