// SPDX-License-Identifier: MIT
module cilantro.registration;

import cilantro.eigen;

namespace cilantro {
namespace {

/// The features that say something, side by side, and which they are.
template <Scalar S>
struct known_features {
  Eigen::Matrix<S, dynamic, dynamic> columns;
  index_list indices;

  explicit known_features(points_view<S, dynamic> all) {
    for (index_t i = 0; i < all.size(); ++i)
      if (is_finite(all[i]) && !all[i].isZero(0)) indices.push_back(static_cast<std::int32_t>(i));
    columns.resize(all.dimension(), std::ssize(indices));
    for (index_t i = 0; i < columns.cols(); ++i) columns.col(i) = all[indices[i]];
  }
};

/// The nearest of `target` to each column of `source`, or −1 if it does not count.
template <Scalar S>
std::vector<neighbor<S>> nearest_features(const Eigen::Matrix<S, dynamic, dynamic>& source,
                                          const Eigen::Matrix<S, dynamic, dynamic>& target,
                                          double ratio, const match_options& options) {
  std::vector<neighbor<S>> nearest(static_cast<std::size_t>(source.cols()), {-1, 0});
  if (source.cols() == 0 || target.cols() == 0) return nearest;
  const brute_force_searcher searcher{target};
  visit_neighborhoods(
      searcher, source, knn{ratio < 1 ? 2 : 1},
      [&](const neighborhood_block<S>& block) {
        for (index_t i = 0; i < block.size(); ++i) {
          const auto distances = block[i].distances();
          if (distances.empty() || !(double(distances[0]) <= options.max_distance)) continue;
          if (distances.size() > 1 && !(double(distances[0]) <= ratio * double(distances[1])))
            continue;
          nearest[block.query(i)] = {block[i].indices()[0], distances[0]};
        }
      },
      {.threads = options.threads, .monitor = options.monitor});
  return nearest;
}

}  // namespace

template <Scalar S>
correspondences<S> closed_match_features(points_view<S, dynamic> source,
                                         points_view<S, dynamic> target,
                                         const match_options& given) {
  expects(source.empty() || target.empty() || source.dimension() == target.dimension(),
          "match_features: source and target must have features of the same dimension");
  expects(given.ratio > 0 && given.ratio <= 1, "match_features: ratio must be in (0, 1]");
  expect_from(0, given.max_distance, "match_features: max_distance");
  match_options options = given;
  options.monitor = in_passes(given.monitor, given.mutual ? 2 : 1);
  const known_features<S> moving{source}, onto{target};
  const auto forward = nearest_features<S>(moving.columns, onto.columns, options.ratio, options);

  std::vector<neighbor<S>> back;
  index_list place(static_cast<std::size_t>(onto.columns.cols()), -1);
  if (options.mutual) {
    // Only those that were chosen have to choose.
    Eigen::Matrix<S, dynamic, dynamic> chosen(onto.columns.rows(), onto.columns.cols());
    index_t count = 0;
    for (const auto& n : forward)
      if (n.index >= 0 && place[n.index] < 0) {
        chosen.col(count) = onto.columns.col(n.index);
        place[n.index] = static_cast<std::int32_t>(count++);
      }
    back = nearest_features<S>(chosen.leftCols(count), moving.columns, 1, options);
  }
  correspondences<S> pairs;
  for (index_t i = 0; i < std::ssize(forward); ++i) {
    const auto& [j, distance] = forward[i];
    if (j < 0 || (options.mutual && back[place[j]].index != i)) continue;
    pairs.push_back({moving.indices[i], onto.indices[j], distance});
  }
  return pairs;
}

template correspondences<float> closed_match_features(points_view<float, dynamic>,
                                                      points_view<float, dynamic>,
                                                      const match_options&);
template correspondences<double> closed_match_features(points_view<double, dynamic>,
                                                       points_view<double, dynamic>,
                                                       const match_options&);

}  // namespace cilantro
