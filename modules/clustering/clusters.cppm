// SPDX-License-Identifier: MIT
export module cilantro.clustering:clusters;

import cilantro.standard;
import cilantro.core;

namespace cilantro {

/// Which points belong together: the result of every algorithm of this module.
///
/// A range of clusters, the largest first; equally large ones in the order of their smallest index.
/// Each is a span of the indices of its points, ascending; no cluster is empty.
export class clusters {
 public:
  using label = std::int32_t;
  /// The label of a point that is in no cluster.
  static constexpr label none = -1;

  clusters() : offsets_(1, 0) {}
  /// From one label per point: points with equal labels form a cluster, those with negative labels
  /// are in none. Clusters are renumbered. Throws `invalid_input` for a label that is not below the
  /// number of points. O(N + K log K).
  explicit clusters(std::vector<label> labels);

  /// The number of clusters.
  [[nodiscard]] index_t size() const { return std::ssize(offsets_) - 1; }
  [[nodiscard]] bool empty() const { return size() == 0; }
  /// The points of cluster c. Precondition: 0 <= c < size().
  [[nodiscard]] std::span<const std::int32_t> operator[](index_t c) const [[clang::lifetimebound]] {
    const auto begin = static_cast<std::size_t>(offsets_[c]);
    const auto end = static_cast<std::size_t>(offsets_[static_cast<std::size_t>(c) + 1]);
    return std::span{members_}.subspan(begin, end - begin);
  }
  [[nodiscard]] auto begin() const [[clang::lifetimebound]] {
    return indexed_iterator{indexed_rows{this}, 0};
  }
  [[nodiscard]] auto end() const [[clang::lifetimebound]] { return begin() + size(); }

  /// For each point, the number of its cluster, or `none`.
  [[nodiscard]] std::span<const label> labels() const [[clang::lifetimebound]] { return labels_; }
  /// The number of points of each cluster.
  [[nodiscard]] std::vector<index_t> sizes() const;
  /// The number of points that are in no cluster.
  [[nodiscard]] index_t unlabeled() const { return std::ssize(labels_) - std::ssize(members_); }

  /// Whether the same points are in the same clusters.
  friend bool operator==(const clusters& a, const clusters& b) { return a.labels_ == b.labels_; }

 private:
  std::vector<label> labels_;
  std::vector<index_t> offsets_;
  std::vector<std::int32_t> members_;
};

/// A colour for each label: red, green and blue in [0, 1]. A label always has the same colour.
/// Those of the first twenty are all clearly different, at least 34 apart in CIELAB, and of
/// consecutive ones after them, too; points without a cluster are dark grey.
export [[nodiscard]] Eigen::Matrix<float, 3, dynamic> label_colors(
    std::span<const clusters::label> labels);

}  // namespace cilantro
