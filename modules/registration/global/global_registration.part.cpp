// SPDX-License-Identifier: MIT
//
// Candidates, what speaks for them, and the verdict.
module cilantro.registration:global_registration;

import cilantro.standard;
import cilantro.eigen;
import cilantro.core;
import cilantro.search;
import cilantro.geometry;
import :align_globally;
import :concepts;
import :correspondence;
import :global_problem;
import :least_squares;
import :motion;
import :pair_fit;
import :pair_graph;
import :point_to_point;
import :putative_pairs;
import :residual;
import :surface_check;
import :surface_fit;

namespace cilantro {

/// Candidates that are compared on points, and those that are refined there.
inline constexpr std::size_t most_compared = 24, most_refined = 8;
/// Pairs that must agree where nothing but pairs and overlap speaks for a transform, and where
/// viewpoints do.
inline constexpr index_t enough_pairs = 30, enough_pairs_seen = 8;
/// What viewpoints contradict less is confirmed.
inline constexpr double confirmed = 0.01;
/// By pairs alone, what chance would give less often than in one of 10 to the power of this many
/// cases is no chance.
inline constexpr double least_significance = 4;
/// A candidate that so much less pairs agree with is no rival, whatever its points say.
inline constexpr double clear_share = 0.15;
/// Pairs closer than this many times the distance of a right one do not speak for a transform by
/// themselves.
inline constexpr double places_apart = 2;
/// A candidate whose score is this share of the best one's might be the right one.
inline constexpr double rival_share = 0.8;

/// A transform, and what speaks for it.
template <int D>
struct judged {
  pair_proposal<D> proposal;
  agreement pairs;
  surface_evidence surface = {};
  double score = 0;
};

/// How far two transforms move points apart, root mean square over a set of that mean and
/// covariance.
template <int D>
class displacement {
 public:
  explicit displacement(const point_matrix<double, D>& points)
      : mean_{points.rowwise().mean()},
        covariance_{(points.colwise() - mean_) * (points.colwise() - mean_).transpose() /
                    double(points.cols())} {}

  [[nodiscard]] double between(const pair_proposal<D>& a, const pair_proposal<D>& b) const {
    const Eigen::Matrix<double, D, D> turn = a.linear() - b.linear();
    const point_vector<double, D> shift = turn * mean_ + a.translation - b.translation;
    return std::sqrt(shift.squaredNorm() + (turn * covariance_ * turn.transpose()).trace());
  }

 private:
  point_vector<double, D> mean_;
  Eigen::Matrix<double, D, D> covariance_;
};

/// How unlikely it is that chance makes so many of the pairs agree with some transform: −log10 of
/// the expected number of transforms that do, of all that samples of `sample` pairs give, where
/// wrong pairs agree with the share `by_chance`.
/// Source: Moisan & Stival 2004, "A probabilistic criterion to detect rigid point matches between
/// two images", section 3.
inline double significance(index_t agreeing, index_t pairs, index_t sample, double by_chance) {
  const auto log_choose = [](index_t n, index_t k) {
    double sum = 0;
    for (index_t i = 0; i < k; ++i) sum += std::log10(double(n - i) / double(i + 1));
    return sum;
  };
  if (agreeing <= sample) return 0;
  const index_t rest = pairs - sample, more = agreeing - sample;
  // The largest term of the tail stands for all of it.
  const double log_tail = log_choose(rest, more) + double(more) * std::log10(by_chance);
  return -(log_choose(pairs, sample) + std::min(log_tail, 0.0));
}

inline void report(const global_options& options, double share) {
  if (options.monitor.progress) options.monitor.progress(share);
}

template <int D>
class global_registration {
 public:
  global_registration(const global_problem<D>& problem, const global_options& options)
      : problem_{problem}, pairs_{problem.pairs}, options_{options} {}

  [[nodiscard]] found_globally run() {
    found_globally result;
    result.matches = pairs_.size();
    propose();
    report(options_, 0.5);
    if (problem_.source)
      judge_by_surfaces(result);
    else
      judge_by_pairs(result);
    report(options_, 1);
    return result;
  }

 private:
  /// The candidates that the pairs suggest, different ones, the best one first.
  void propose() {
    const execution how{options_.threads, {{}, options_.monitor.stop}};
    putative_pairs<D> some = pairs_.size() <= most_graph_pairs ? pairs_ : thinned();
    some.any_scale = false;
    std::vector<pair_proposal<D>> proposals;
    for (const double scale : scales()) {
      some.source *= scale;
      for (auto& proposal : options_.solver.propose(some, how)) {
        proposal.scale *= scale;
        proposals.push_back(proposal);
      }
      some.source /= scale;
    }
    std::vector<judged<D>> all(proposals.size());
    parallel_blocks(std::ssize(all), 1, how, [&](index_t k, index_t, index_t) {
      auto [proposal, agree] = refined<D>(pairs_, proposals[k]);
      all[k] = {proposal, std::move(agree)};
      all[k].score = all[k].pairs.score;
    });
    keep_different(all);
  }

  /// Scales so close to each other that at one of them right pairs stay within `max_distance`.
  [[nodiscard]] std::vector<double> scales() const {
    if (!pairs_.any_scale || pairs_.size() == 0) return {1};
    const double extent = std::sqrt(pairs_.target.squaredNorm() / double(pairs_.size()));
    const double step = 1 + std::clamp(pairs_.max_distance / extent, 0.005, 0.5);
    std::vector<double> all;
    double scale = options_.scales->smallest;
    while (scale < options_.scales->largest) {
      all.push_back(scale);
      scale *= step;
    }
    all.push_back(options_.scales->largest);
    return all;
  }

  [[nodiscard]] putative_pairs<D> thinned() const {
    putative_pairs<D> some = pairs_;
    const auto kept = random_indices(pairs_.size(), most_graph_pairs);
    some.numbers.clear();
    resize(some, std::ssize(kept), pairs_.has_normals());
    for (index_t i = 0; i < std::ssize(kept); ++i) {
      some.source.col(i) = pairs_.source.col(kept[i]);
      some.target.col(i) = pairs_.target.col(kept[i]);
      if (pairs_.has_normals()) {
        some.source_normals.col(i) = pairs_.source_normals.col(kept[i]);
        some.target_normals.col(i) = pairs_.target_normals.col(kept[i]);
      }
      some.numbers.push_back(pairs_.numbers[kept[i]]);
    }
    return some;
  }

  /// Of candidates that are nearly the same, the best one; all by descending score.
  void keep_different(std::vector<judged<D>>& all) {
    candidates_.clear();
    if (pairs_.size() == 0) return;
    std::ranges::sort(all, std::ranges::greater{}, &judged<D>::score);
    const displacement<D> apart{problem_.source ? problem_.source->points : pairs_.source};
    for (auto& one : all) {
      const bool is_new = std::ranges::none_of(candidates_, [&](const judged<D>& other) {
        return apart.between(one.proposal, other.proposal) < 3 * pairs_.max_distance;
      });
      if (is_new) candidates_.push_back(std::move(one));
    }
  }

  void judge_by_pairs(found_globally& result) {
    if (candidates_.empty()) return;
    const double chance = agreeing_by_chance(candidates_.front().proposal);
    std::erase_if(candidates_, [&](const judged<D>& one) {
      return significance(std::ssize(one.pairs.members), pairs_.size(), D, chance) <
             least_significance;
    });
    if (candidates_.empty()) return;
    const bool is_sure = significance(separate_places(candidates_.front().pairs.members),
                                      pairs_.size(), D, chance) >= least_significance;
    result.status = is_sure && !has_rival() ? global_status::unique : global_status::ambiguous;
    const known_pairs fit = agreeing_points(candidates_.front());
    const auto map = absolute(candidates_.front().proposal);
    if (pairs_.any_scale) {
      const least_squares_estimator<double, D, point_to_point, similarity_motion> estimator{
          fit.source, fit.target};
      finish(result, estimator.estimate(map, fit.pairs).fit);
    } else {
      const point_to_point_estimator<double, D> estimator{fit.source, fit.target};
      const auto rigid =
          make_transform<rigid_transform<double, D>>(map.linear(), map.translation());
      finish(result, estimator.estimate(rigid, fit.pairs).fit);
    }
  }

  /// How many of some pairs are apart from one another, at most 256. Wrong pairs are not wrong
  /// independently of those next to them: a wall is matched to another one as a whole. In a plane
  /// all count, since right pairs alone are as close as that there.
  [[nodiscard]] index_t separate_places(const index_list& members) const {
    if constexpr (D == 2) return std::ssize(members);
    const double least = places_apart * pairs_.max_distance;
    index_list kept;
    for (const auto i : members) {
      if (std::ranges::all_of(kept, [&](index_t j) {
            return (pairs_.source.col(i) - pairs_.source.col(j)).squaredNorm() > least * least;
          }))
        kept.push_back(i);
      if (std::ssize(kept) == 256) break;
    }
    return std::ssize(kept);
  }

  /// The share of random pairings that agree with a transform.
  [[nodiscard]] double agreeing_by_chance(const pair_proposal<D>& proposal) const {
    const index_t looked_at = std::min<index_t>(pairs_.size(), 256);
    const double limit = pairs_.max_distance * pairs_.max_distance;
    index_t agreeing = 0, all = 0;
    for (index_t k = 0; k < looked_at; ++k) {
      const index_t i = k * pairs_.size() / looked_at;
      const point_vector<double, D> place =
          proposal.linear() * pairs_.source.col(i) + proposal.translation;
      for (index_t j = 0; j < pairs_.size(); ++j) {
        if (i == j) continue;
        ++all;
        agreeing += (pairs_.target.col(j) - place).squaredNorm() <= limit;
      }
    }
    return double(agreeing + 1) / double(all + 1);
  }

  void judge_by_surfaces(found_globally& result) {
    const auto &source = *problem_.source, &target = *problem_.target;
    const surface_check<D> check{source, target, problem_.voxel, pairs_.oriented, options_.threads};
    const bool is_seen = source.seen || target.seen;
    const auto look_at = [&](judged<D>& one, index_t step) {
      one.surface = check.compare(one.proposal, step);
      one.score = one.surface.score();
    };
    // Where the pairs are this clear, points need not be asked.
    std::erase_if(candidates_,
                  [best = candidates_.empty() ? 0 : candidates_.front().score](
                      const judged<D>& one) { return one.pairs.score < clear_share * best; });
    if (candidates_.size() > most_compared) candidates_.resize(most_compared);
    const index_t coarse = std::max<index_t>(1, source.points.cols() / 500);
    for (auto& one : candidates_) look_at(one, coarse);
    auto all = std::move(candidates_);
    std::ranges::sort(all, std::ranges::greater{}, &judged<D>::score);
    if (all.size() > most_refined) all.resize(most_refined);
    for (auto& one : all) {
      refine(one, std::max<index_t>(1, source.points.cols() / 1000), 2 * problem_.voxel, 8);
      look_at(one, 1);
    }
    if (is_seen)
      std::erase_if(all, [](const judged<D>& one) {
        return one.surface.contradicted_share() > most_contradicted;
      });
    const index_t least = is_seen ? D + 1 : enough_pairs_seen;
    // Where no surface supports any candidate, no candidate is better than another.
    std::erase_if(all, [&](const judged<D>& one) {
      return std::ssize(one.pairs.members) < least || !(one.score > 0);
    });
    keep_different(all);
    if (candidates_.empty()) return;

    auto& best = candidates_.front();
    const auto fit = refine(best, 1, problem_.voxel, 15);
    look_at(best, 1);
    const auto agreeing = std::ssize(best.pairs.members);
    const double contradicted = best.surface.contradicted_share();
    const bool is_confirmed =
        agreeing >= enough_pairs ||
        (source.seen && target.seen && agreeing >= enough_pairs_seen && contradicted <= confirmed);
    result.status = is_confirmed && !has_rival() ? global_status::unique : global_status::ambiguous;
    if (fit.pairs == 0 || (is_seen && contradicted > most_contradicted)) {
      result.status = global_status::too_few;
      return;
    }
    finish(result, around_origin<D>(fit, problem_.target_center));
  }

  /// Whether another candidate is nearly as good as the best one.
  [[nodiscard]] bool has_rival() const {
    return candidates_.size() > 1 && candidates_[1].score > rival_share * candidates_[0].score;
  }

  /// Refines a candidate on every `step`-th point of the source.
  alignment_fit refine(judged<D>& one, index_t step, double max_distance, int iterations) const {
    const auto found = settle<D>(*problem_.source, *problem_.target, one.proposal, pairs_.up,
                                 {.voxel = problem_.voxel,
                                  .max_distance = max_distance,
                                  .step = step,
                                  .iterations = iterations,
                                  .threads = options_.threads,
                                  .stop = options_.monitor.stop});
    if (!found) return {};
    one.proposal = found->first;
    one.pairs = agreeing_pairs(pairs_, one.proposal);
    return found->second;
  }

  /// From the coordinates of the source to those of the target, as they were given.
  [[nodiscard]] affine_transform<double, D> absolute(const pair_proposal<D>& proposal) const {
    return between_origins<D>(proposal, problem_.source_center, problem_.target_center);
  }

  struct known_pairs {
    point_matrix<double, D> source, target;
    correspondences<double> pairs;
  };
  /// The pairs that agree with a candidate, in the coordinates that were given.
  [[nodiscard]] known_pairs agreeing_points(const judged<D>& one) const {
    known_pairs found;
    const auto count = std::ssize(one.pairs.members);
    found.source.resize(D, count);
    found.target.resize(D, count);
    for (index_t k = 0; k < count; ++k) {
      found.source.col(k) = pairs_.source.col(one.pairs.members[k]) + problem_.source_center;
      found.target.col(k) = pairs_.target.col(one.pairs.members[k]) + problem_.target_center;
      found.pairs.push_back({static_cast<std::int32_t>(k), static_cast<std::int32_t>(k), 0});
    }
    return found;
  }

  void finish(found_globally& result, const alignment_fit& fit) const {
    static_cast<alignment_fit&>(result) = fit;
    if (fix_no_rotation<D>(pairs_, candidates_.front().pairs.members) ||
        (result.status == global_status::unique && fit.undetermined > 0))
      result.status = global_status::degenerate;
    for (const auto i : candidates_.front().pairs.members)
      result.inliers.push_back(problem_.given[pairs_.numbers[i]]);
    for (const auto& one : candidates_) {
      const auto map = absolute(one.proposal);
      result.candidates.push_back({map.linear(), map.translation(), std::ssize(one.pairs.members),
                                   one.surface.overlap(), one.surface.contradicted_share(),
                                   one.score});
    }
  }

  const global_problem<D>& problem_;
  const putative_pairs<D>& pairs_;
  const global_options& options_;
  std::vector<judged<D>> candidates_;
};

}  // namespace cilantro
