// SPDX-License-Identifier: MIT
module cilantro.clustering;

import cilantro.numeric;

namespace cilantro {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

struct edge {
  double weight;
  std::int32_t a, b;
};

/// The edges of the graph by ascending mutual reachability, the larger of both core distances and
/// their own length.
template <Scalar S>
std::vector<edge> reachability_edges(const neighborhoods<S>& graph, index_t min_points) {
  std::vector<double> core;
  for (const auto& near : graph)
    core.push_back(std::ssize(near) < min_points ? infinity
                                                 : double(near[min_points - 1].distance));
  std::vector<edge> edges;
  for (index_t i = 0; i < graph.size(); ++i)
    for (const auto& [j, distance] : graph[i]) {
      const double weight = std::max({core[i], core[j], double(distance)});
      if (i == j || weight == infinity) continue;
      edges.push_back({weight, static_cast<std::int32_t>(std::min(i, j)),
                       static_cast<std::int32_t>(std::max(i, j))});
    }
  std::ranges::sort(edges, [](const edge& x, const edge& y) {
    return std::tie(x.weight, x.a, x.b) < std::tie(y.weight, y.a, y.b);
  });
  return edges;
}

/// The dendrogram: nodes below N are points, node N + m is the m-th merge. What no edge connects is
/// joined at infinity, in the end.
struct merge {
  double weight;
  std::int32_t left, right;
  index_t size;
};

std::vector<merge> single_linkage(const std::vector<edge>& edges, index_t n) {
  disjoint_sets sets{n};
  // Of the set with a representative: its node, and its size.
  std::vector<std::int32_t> node(n);
  std::vector<index_t> size(static_cast<std::size_t>(n), 1);
  for (index_t i = 0; i < n; ++i) node[i] = static_cast<std::int32_t>(i);
  std::vector<merge> merges;
  const auto join = [&](index_t a, index_t b, double weight) {
    const auto x = static_cast<std::size_t>(sets.find(a)),
               y = static_cast<std::size_t>(sets.find(b));
    if (x == y) return;
    merges.push_back({weight, node[x], node[y], size[x] + size[y]});
    sets.join(a, b);
    const auto root = static_cast<std::size_t>(sets.find(a));
    node[root] = static_cast<std::int32_t>(n + std::ssize(merges) - 1);
    size[root] = merges.back().size;
  };
  for (const auto& e : edges) join(e.a, e.b, e.weight);
  for (index_t i = 1; i < n; ++i) join(0, i, infinity);
  return merges;
}

/// A cluster of the condensed tree: one that lasts until it splits in two that are large enough.
struct condensed {
  double birth;  ///< λ, the inverse of a distance.
  index_t parent;
  double stability = 0, below = 0;
  bool is_chosen = false;
};

class condensed_tree {
 public:
  condensed_tree(const std::vector<merge>& merges, index_t n, index_t least)
      : merges_{merges}, n_{n}, least_{least} {
    double smallest = infinity;
    for (const auto& m : merges)
      if (m.weight > 0) smallest = std::min(smallest, m.weight);
    // Equal points are at no distance: as if at half of the smallest one, so that λ is finite.
    most_ = smallest < infinity ? 2 / smallest : 1;
    owner_.resize(n);
    fallen_.resize(n);
    build();
  }

  void choose(bool allow_single_cluster);
  [[nodiscard]] hdbscan_result result() const;

 private:
  /// Of a merge.
  [[nodiscard]] double lambda(std::int32_t node) const {
    const double weight = merges_[node - n_].weight;
    return weight > 0 ? std::min(1 / weight, most_) : most_;
  }
  [[nodiscard]] index_t size(std::int32_t node) const {
    return node < n_ ? 1 : merges_[node - n_].size;
  }
  void build();
  void parts_of(std::int32_t node, std::vector<std::int32_t>& parts) const;
  void drop(std::int32_t node, index_t cluster, double at);

  const std::vector<merge>& merges_;
  index_t n_, least_;
  double most_ = 1;
  std::vector<condensed> clusters_;  ///< Parents before children.
  std::vector<index_t> owner_;       ///< The cluster that each point falls out of.
  std::vector<double> fallen_;       ///< And the λ at which it does.
};

void condensed_tree::build() {
  clusters_.push_back({.birth = 0, .parent = -1});
  if (merges_.empty()) return drop(0, 0, 0);
  // Not by recursion: the tree may be as deep as there are points.
  std::vector<std::pair<std::int32_t, index_t>> open{
      {static_cast<std::int32_t>(n_ + std::ssize(merges_) - 1), 0}};
  std::vector<std::int32_t> parts;
  while (!open.empty()) {
    const auto [node, cluster] = open.back();
    open.pop_back();
    if (node < n_) {
      drop(node, cluster, most_);
      continue;
    }
    const double at = lambda(node);
    parts_of(node, parts);
    const auto large = [&](std::int32_t part) { return size(part) >= least_; };
    const bool splits = std::ranges::count_if(parts, large) > 1;
    for (const auto part : parts) {
      if (!large(part)) {
        drop(part, cluster, at);
      } else if (!splits) {
        open.emplace_back(part, cluster);
      } else {
        clusters_[cluster].stability += double(size(part)) * (at - clusters_[cluster].birth);
        open.emplace_back(part, std::ssize(clusters_));
        clusters_.push_back({.birth = at, .parent = cluster});
      }
    }
  }
}

/// What is left of a node when all its edges of one weight go at once: which of them came first in
/// the dendrogram depends on the order of the points.
void condensed_tree::parts_of(std::int32_t node, std::vector<std::int32_t>& parts) const {
  parts.assign(1, node);
  for (std::size_t i = 0; i < parts.size();) {
    const auto part = parts[i];
    if (part < n_ || lambda(part) != lambda(node)) {
      ++i;
      continue;
    }
    parts[i] = merges_[part - n_].left;
    parts.push_back(merges_[part - n_].right);
  }
}

/// All points below `node` leave their cluster.
void condensed_tree::drop(std::int32_t node, index_t cluster, double at) {
  std::vector<std::int32_t> open{node};
  auto& from = clusters_[cluster];
  while (!open.empty()) {
    const auto next = open.back();
    open.pop_back();
    if (next < n_) {
      owner_[next] = cluster;
      fallen_[next] = at;
      from.stability += at - from.birth;
      continue;
    }
    const auto& m = merges_[next - n_];
    open.push_back(m.left);
    open.push_back(m.right);
  }
}

/// Of each branch the clusters with the most mass: a parent, or its descendants together.
void condensed_tree::choose(bool allow_single_cluster) {
  for (std::size_t c = clusters_.size(); c-- > 0;) {
    auto& one = clusters_[c];
    // Sums in another order are rounded in another way, which must not decide.
    one.is_chosen = one.stability >= one.below * (1 - 1e-12) && (c > 0 || allow_single_cluster);
    if (one.parent >= 0) clusters_[one.parent].below += std::max(one.stability, one.below);
  }
  // Whatever lies below a chosen one belongs to it.
  std::vector<bool> inside(clusters_.size());
  for (std::size_t c = 1; c < clusters_.size(); ++c) {
    const auto parent = static_cast<std::size_t>(clusters_[c].parent);
    inside[c] = inside[parent] || clusters_[parent].is_chosen;
    if (inside[c]) clusters_[c].is_chosen = false;
  }
}

hdbscan_result condensed_tree::result() const {
  std::vector<index_t> chosen;  // Of each cluster: the chosen one that it is, or lies in.
  for (std::size_t c = 0; c < clusters_.size(); ++c) {
    const auto parent = clusters_[c].parent;
    chosen.push_back(clusters_[c].is_chosen ? index_t(c) : parent >= 0 ? chosen[parent] : -1);
  }
  std::vector<clusters::label> labels(owner_.size(), clusters::none);
  std::vector<double> deepest(clusters_.size());
  std::vector<clusters::label> number(clusters_.size(), clusters::none);
  clusters::label next = 0;
  for (std::size_t i = 0; i < owner_.size(); ++i) {
    const index_t c = chosen[owner_[i]];
    // What falls at λ = 0 is infinitely far from all others.
    if (c < 0 || !(fallen_[i] > 0)) continue;
    auto& l = number[c];
    if (l < 0) l = next++;
    labels[i] = l;
    deepest[c] = std::max(deepest[c], fallen_[i]);
  }
  hdbscan_result found{clusters{std::move(labels)}, {}, std::vector<double>(owner_.size())};
  for (const auto members : found) {
    const auto of = static_cast<std::size_t>(chosen[owner_[members.front()]]);
    found.stabilities.push_back(clusters_[of].stability);
    for (const auto i : members)
      found.strengths[i] = deepest[of] > 0 ? fallen_[i] / deepest[of] : 1;
  }
  return found;
}

}  // namespace

template <Scalar S>
hdbscan_result hdbscan(const neighborhoods<S>& graph, const hdbscan_options& options) {
  expect_from(2, double(options.min_cluster_size), "hdbscan: min_cluster_size");
  expect_from(1, double(options.min_points), "hdbscan: min_points");
  expect_nodes(graph, "hdbscan");
  expects(std::ranges::all_of(graph.distances(), [](S d) { return d >= 0; }),
          "hdbscan: a distance is negative or NaN");
  expect_from(0, options.threads, "hdbscan: threads");
  const auto passed = [&](double share) {
    if (options.monitor.stop.stop_requested()) throw cancelled{};
    if (options.monitor.progress) options.monitor.progress(share);
  };
  passed(0);
  if (graph.empty()) return {};
  auto edges = reachability_edges(graph, options.min_points);
  passed(0.3);
  const auto merges = single_linkage(edges, graph.size());
  edges = {};
  passed(0.8);
  condensed_tree tree{merges, graph.size(), options.min_cluster_size};
  tree.choose(options.allow_single_cluster);
  auto found = tree.result();
  if (options.monitor.progress) options.monitor.progress(1);
  return found;
}
template hdbscan_result hdbscan(const neighborhoods<float>&, const hdbscan_options&);
template hdbscan_result hdbscan(const neighborhoods<double>&, const hdbscan_options&);

}  // namespace cilantro
