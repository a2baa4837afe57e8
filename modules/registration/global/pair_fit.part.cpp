// SPDX-License-Identifier: MIT
//
// The rigid transform of some pairs, and the pairs that agree with a transform.
module cilantro.registration:pair_fit;

import cilantro.standard;
import cilantro.eigen;
import cilantro.core;
import :putative_pairs;

namespace cilantro {

/// The least-squares rotation about `up` that maps the cross-covariance's source onto its target.
template <int D>
Eigen::Matrix<double, D, D> rotation_of(const Eigen::Matrix<double, D, D>& cross,
                                        const std::optional<point_vector<double, D>>& up) {
  if constexpr (D == 3) {
    if (up) {
      // With cross = Σ t sᵀ: Σ (s × t) · up, and Σ s · t across the direction.
      const Eigen::Vector3d turn{cross(2, 1) - cross(1, 2), cross(0, 2) - cross(2, 0),
                                 cross(1, 0) - cross(0, 1)};
      const double along = cross.trace() - up->dot(cross * *up), across = turn.dot(*up);
      return Eigen::AngleAxisd{std::atan2(across, along), *up}.toRotationMatrix();
    }
  }
  return nearest_rotation(cross);
}

/// Sums over the pairs `members`.
template <int D>
struct pair_sums {
  point_vector<double, D> source = point_vector<double, D>::Zero(),
                          target = point_vector<double, D>::Zero();  ///< Means.
  Eigen::Matrix<double, D, D> cross = Eigen::Matrix<double, D, D>::Zero(),
                              spread = Eigen::Matrix<double, D, D>::Zero();

  /// With a weight for each member, or none.
  pair_sums(const putative_pairs<D>& pairs, std::span<const std::int32_t> members,
            std::span<const double> weights = {}) {
    const auto weight = [&](std::size_t k) { return weights.empty() ? 1 : weights[k]; };
    double total = 0;
    for (std::size_t k = 0; k < members.size(); ++k) {
      source += weight(k) * pairs.source.col(members[k]);
      target += weight(k) * pairs.target.col(members[k]);
      total += weight(k);
    }
    source /= total;
    target /= total;
    for (std::size_t k = 0; k < members.size(); ++k) {
      const point_vector<double, D> s = pairs.source.col(members[k]) - source;
      cross += weight(k) * (pairs.target.col(members[k]) - target) * s.transpose();
      spread += weight(k) * s * s.transpose();
    }
    cross /= total;
    spread /= total;
  }
};

/// Whether the source points of the pairs lie so near to a line (in two dimensions, or with a
/// vertical, to a point; to the vertical) that they fix no rotation, as far as they are known.
template <int D>
bool fix_no_rotation(const putative_pairs<D>& pairs, std::span<const std::int32_t> members) {
  if (members.empty()) return true;
  Eigen::Matrix<double, D, D> spread = pair_sums<D>{pairs, members}.spread;
  if (pairs.up) {
    const Eigen::Matrix<double, D, D> across =
        Eigen::Matrix<double, D, D>::Identity() - *pairs.up * pairs.up->transpose();
    spread = across * spread * across;
  }
  const auto extents = decompose_symmetric<D>(spread).values;
  const double least = pairs.max_distance / 2;
  return !(extents[pairs.up ? D - 1 : 1] > least * least);
}

/// The transform with the least sum of squares over the pairs `members`, with a scale if the pairs
/// have any scale, and never a reflection. Where they do not fix the rotation, it turns as little
/// as possible.
/// Source: Umeyama 1991, "Least-squares estimation of transformation parameters".
template <int D>
std::optional<pair_proposal<D>> fit_pairs(const putative_pairs<D>& pairs,
                                          std::span<const std::int32_t> members,
                                          std::span<const double> weights = {}) {
  if (members.empty()) return std::nullopt;
  const pair_sums<D> sums{pairs, members, weights};
  if (!sums.cross.allFinite()) return std::nullopt;
  pair_proposal<D> found;
  found.rotation = rotation_of<D>(sums.cross, pairs.up);
  if (pairs.any_scale) {
    found.scale = found.rotation.cwiseProduct(sums.cross).sum() / sums.spread.trace();
    if (!(found.scale > 0)) return std::nullopt;
  }
  found.translation = sums.target - found.linear() * sums.source;
  return found;
}

/// The pairs that agree with a proposal, and how well: each counts as 1 − distance / max_distance.
struct agreement {
  std::vector<std::int32_t> members;
  double score = 0;
};
template <int D>
agreement agreeing_pairs(const putative_pairs<D>& pairs, const pair_proposal<D>& proposal) {
  agreement found;
  const double limit = pairs.max_distance * pairs.max_distance;
  const Eigen::Matrix<double, D, D> linear = proposal.linear();
  for (index_t i = 0; i < pairs.size(); ++i) {
    const point_vector<double, D> off =
        linear * pairs.source.col(i) + proposal.translation - pairs.target.col(i);
    const double square = off.squaredNorm();
    if (!(square <= limit)) continue;
    if (pairs.has_normals()) {
      const double cosine =
          (proposal.rotation * pairs.source_normals.col(i)).dot(pairs.target_normals.col(i));
      const bool is_known =
          !pairs.source_normals.col(i).isZero(0) && !pairs.target_normals.col(i).isZero(0);
      if (is_known && (pairs.oriented ? cosine : std::abs(cosine)) < 0.5) continue;
    }
    found.members.push_back(static_cast<std::int32_t>(i));
    found.score += 1 - std::sqrt(square) / pairs.max_distance;
  }
  return found;
}

/// A proposal, fitted again to the pairs that agree with it, a few times.
template <int D>
std::pair<pair_proposal<D>, agreement> refined(const putative_pairs<D>& pairs,
                                               pair_proposal<D> proposal) {
  auto best = agreeing_pairs(pairs, proposal);
  for (int i = 0; i < 4; ++i) {
    const auto next = fit_pairs<D>(pairs, best.members);
    if (!next) break;
    auto agree = agreeing_pairs(pairs, *next);
    if (!(agree.score > best.score)) break;
    best = std::move(agree);
    proposal = *next;
  }
  return {proposal, std::move(best)};
}

}  // namespace cilantro
