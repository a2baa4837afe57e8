// SPDX-License-Identifier: MIT
export module cilantro.consensus:ransac;

import cilantro.standard;
import cilantro.core;

namespace cilantro {

/// A family of models of some data, which are numbered from 0 to `size()` − 1. RANSAC looks for the
/// model that most of the data agree with.
///
/// Semantics: `fit(indices)` returns the model of a minimal sample of `sample_size()` data, or the
/// least-squares model of more data; nothing if the data are degenerate or not finite, or the model
/// is not allowed. `residual(model, i)` is how far datum i is from agreeing with the model: not
/// negative, or NaN for a datum that is not finite. Both are const, depend on nothing but their
/// arguments, and are called from several threads at once. Optional, for speed: a type `scalar`
/// with `residuals(model, first, out)`, which fills a `std::span<scalar>` with the residuals of
/// consecutive data from `first` on, and replaces `residual`; and `score(models, first, count,
/// scoring, sums)`, which adds to each entry of a `std::span<data_score>` the score of `count` data
/// from `first` on for one of up to `models_at_a_time` models, and replaces both.
/// Models: `hyperplane_family`, `line_family`, `sphere_family`, `circle_family`, `cylinder_family`,
/// `transform_family`; `check_model_family` tests yours.
export template <class F>
concept ModelFamily =
    requires {
      typename F::model_type;
      requires std::copyable<typename F::model_type>;
    } && requires(const F& family, std::span<const std::int32_t> indices,
                  const typename F::model_type& model, index_t i) {
      { family.size() } -> std::convertible_to<index_t>;
      { family.sample_size() } -> std::convertible_to<index_t>;
      { family.fit(indices) } -> std::same_as<std::optional<typename F::model_type>>;
      { family.residual(model, i) } -> std::convertible_to<double>;
    };

/// The score by which the best model is chosen.
export enum class ransac_score {
  inliers,  ///< The number of inliers.
  msac,     ///< Each inlier counts 1 − (residual / max_residual)², so that near ones count more.
};

/// The score of a model over some data: the number of `inliers`, and the `value`.
export struct data_score {
  index_t inliers = 0;
  double value = 0;  ///< By the chosen score.
};

/// How data are scored: `by` which score, with residuals up to `max_residual` as inliers.
export struct residual_scoring {
  double max_residual;
  ransac_score by;
  /// One entry per datum of the whole family, 0 for data that do not count; or empty.
  std::span<const std::uint8_t> active = {};
};

/// The most models for which `score` is called at once.
export inline constexpr index_t models_at_a_time = 8;

/// A family that scores several models at once.
template <class F>
concept ScoresModels =
    requires(const F& family, std::span<const typename F::model_type> models, index_t i,
             const residual_scoring& scoring,
             std::span<data_score> sums) { family.score(models, i, i, scoring, sums); };

/// Options of `ransac` and `sequential_ransac`.
export struct ransac_options {
  /// Data with at most this residual are inliers. It has no default, since it is in the units of
  /// the residuals.
  positive max_residual;
  ransac_score score = ransac_score::msac;  ///< How models are compared.
  /// The search ends once a sample without outliers has been drawn with this probability, judged by
  /// the share of inliers of the best model so far. At 1, it runs to `max_iterations`.
  double confidence = 0.999;
  index_t max_iterations = 1000;  ///< The most samples that are drawn.
  /// A model with fewer inliers, or fewer than a sample, is not returned.
  index_t min_inliers = 0;
  /// Whether each new best model is refitted to its inliers as long as its score improves; for more
  /// than 65,536 data, to the inliers among about 32,768 of them.
  bool local_optimization = true;
  /// Whether the final model is refitted to its inliers until these stay the same, at most ten
  /// times.
  bool refit = true;
  /// If positive, each model is first tried on this many random data, and rejected if its share of
  /// inliers among them is more than three standard deviations below that of the best model. Saves
  /// most of the work on large data; rejects a better model about once in a thousand times.
  index_t preview = 0;
  std::uint64_t seed = 0;  ///< Determines the samples.
  int threads = 0;
  task_monitor monitor = {};
};

/// The `model` that was found, and the data that agree with it.
export template <class Model>
struct ransac_result {
  Model model;
  index_list inliers;      ///< Ascending.
  double score = 0;        ///< The score of the model after the last fit.
  double rmse = 0;         ///< Root mean square of the residuals of the inliers.
  index_t iterations = 0;  ///< The number of samples drawn.
};

template <class F>
struct residual_scalar {
  using type = double;
};
template <class F>
  requires requires { typename F::scalar; }
struct residual_scalar<F> {
  using type = typename F::scalar;
};

/// A scoring converted to the scalar of the residuals.
template <Scalar S>
struct scoring_limits {
  /// The largest S that is at most the limit, so that comparing in S is the same as in double.
  S largest;
  S scale;  ///< Inliers count 1 − scale · residual²; 0 where they all count alike.
};
template <Scalar S>
scoring_limits<S> limits_of(const residual_scoring& scoring);

/// The score of residuals; `scoring.active` has as many entries, or none.
template <Scalar S>
data_score score_of(std::span<const S> residuals, const residual_scoring& scoring);
void expect_sensible(const ransac_options& options);
/// How many samples it takes to draw one without outliers with the given probability.
double samples_needed(double confidence, double share, index_t sample_size);
/// Whether a share of inliers in `count` data is too small to be that of a model as good as `best`.
bool is_hopeless(double share, double best, index_t count);

/// How many data are scored before checking again whether a model can still win.
inline constexpr index_t score_block_size = 1024;
/// How many samples are tried before the next decision: at most, and at first.
inline constexpr index_t most_samples_ahead = 32, least_samples_ahead = 4;
/// While models are still compared, fits to large data use only this many blocks, evenly spread.
inline constexpr index_t most_blocks_fitted = 32;
/// The most fits of a model to its inliers, one after another.
inline constexpr int most_refits = 10;

/// The search among the data of a family that are still active.
template <ModelFamily F>
class ransac_search {
 public:
  using model_type = typename F::model_type;
  using scalar = typename residual_scalar<F>::type;

  ransac_search(const F& family, const ransac_options& options)
      : family_{family}, options_{options}, size_{family.size()} {
    expect_sensible(options);
    expects(family.sample_size() > 0, "ransac: sample_size() must be positive");
    for (index_t i = 0; i < size_; ++i) left_.push_back(static_cast<std::int32_t>(i));
  }

  /// The best model, or nothing. `round` makes the samples differ from those of other rounds.
  [[nodiscard]] std::optional<ransac_result<model_type>> find(std::uint64_t round);
  /// Excludes some data from now on.
  void remove(std::span<const std::int32_t> indices) {
    if (active_.empty()) active_.assign(static_cast<std::size_t>(size_), 1);
    for (const index_t i : indices) active_[i] = 0;
    std::erase_if(left_, [&](index_t i) { return !active_[i]; });
  }

 private:
  struct candidate {
    std::optional<model_type> model;
    data_score score;
  };

  void residuals(const model_type& model, index_t first, std::span<scalar> out) const {
    if constexpr (requires { family_.residuals(model, first, out); }) {
      family_.residuals(model, first, out);
    } else {
      for (scalar& r : out) r = static_cast<scalar>(family_.residual(model, first++));
    }
  }
  [[nodiscard]] std::span<const std::uint8_t> active(index_t first, std::size_t count) const {
    return active_.empty() ? std::span<const std::uint8_t>{}
                           : std::span{active_}.subspan(static_cast<std::size_t>(first), count);
  }

  /// Adds the score of a block of data for each model.
  void score_block(std::span<const model_type> models, index_t first, index_t count,
                   std::span<data_score> sums) const {
    const residual_scoring all{options_.max_residual, options_.score, active_};
    if constexpr (ScoresModels<F>) {
      family_.score(models, first, count, all, sums);
    } else {
      const auto size = static_cast<std::size_t>(count);
      std::array<scalar, score_block_size> room;
      const std::span out{room.data(), size};
      for (std::size_t m = 0; m < models.size(); ++m) {
        residuals(models[m], first, out);
        const auto part = score_of<scalar>(out, {all.max_residual, all.by, active(first, size)});
        sums[m].inliers += part.inliers;
        sums[m].value += part.value;
      }
    }
  }
  /// The scores of some models; incomplete for models whose score cannot exceed `bound`.
  [[nodiscard]] std::array<data_score, models_at_a_time> score(std::vector<model_type> models,
                                                               double bound) const {
    std::array<data_score, models_at_a_time> all, sums;
    std::array<std::size_t, models_at_a_time> place;
    for (std::size_t m = 0; m < models.size(); ++m) place[m] = m;
    for (index_t first = 0; first < size_ && !models.empty(); first += score_block_size) {
      const index_t count = std::min(score_block_size, size_ - first);
      score_block(models, first, count, sums);
      std::size_t left = 0;
      for (std::size_t m = 0; m < models.size(); ++m) {
        all[place[m]] = sums[m];
        if (!(sums[m].value + double(size_ - first - count) > bound)) continue;
        if (left != m) models[left] = std::move(models[m]);
        sums[left] = sums[m];
        place[left++] = place[m];
      }
      models.erase(models.begin() + static_cast<std::ptrdiff_t>(left), models.end());
    }
    return all;
  }
  [[nodiscard]] data_score score(const model_type& model, double bound) const {
    return score(std::vector{model}, bound)[0];
  }
  /// The inliers in every `step`-th block of data.
  [[nodiscard]] index_list inliers(const model_type& model, index_t step = 1) const {
    index_list found;
    std::array<scalar, score_block_size> room;
    std::array<std::int32_t, score_block_size> some;
    const double limit = options_.max_residual;
    for (index_t first = 0; first < size_; first += step * score_block_size) {
      const auto size = static_cast<std::size_t>(std::min(score_block_size, size_ - first));
      residuals(model, first, std::span{room}.first(size));
      const auto mask = active(first, size);
      std::size_t count = 0;
      // Without a branch: the processor could not predict which data agree.
      for (std::size_t k = 0; k < size; ++k) {
        some[count] = static_cast<std::int32_t>(first + static_cast<index_t>(k));
        count += double(room[k]) <= limit && (mask.empty() || mask[k]);
      }
      found.insert(found.end(), some.begin(), some.begin() + static_cast<index_t>(count));
    }
    return found;
  }

  [[nodiscard]] std::optional<model_type> draw(std::uint64_t round, index_t iteration,
                                               const candidate& best) const;
  void try_samples(std::uint64_t round, index_t iteration, std::span<candidate> next,
                   const candidate& best) const;
  void improve(candidate& best) const;
  [[nodiscard]] std::optional<ransac_result<model_type>> finish(candidate best,
                                                                index_t iterations) const;

  const F& family_;
  const ransac_options& options_;
  index_t size_;
  index_list left_;                   ///< The data that are still active.
  std::vector<std::uint8_t> active_;  ///< The same as a mask; empty while all are.
  index_list preview_ = {};           ///< Data that models are first tried on.
};

/// The model of a sample, unless the preview rejects it.
template <ModelFamily F>
auto ransac_search<F>::draw(std::uint64_t round, index_t iteration, const candidate& best) const
    -> std::optional<model_type> {
  auto sample = distinct_sample(
      std::ssize(left_), family_.sample_size(),
      random_stream{options_.seed, (round << 40) + static_cast<std::uint64_t>(iteration)});
  for (auto& i : sample) i = left_[i];
  auto model = family_.fit(sample);
  if (!model || preview_.empty() || !best.model) return model;
  index_t agree = 0;
  for (const index_t i : preview_)
    agree += double(family_.residual(*model, i)) <= options_.max_residual;
  const auto count = std::ssize(preview_);
  if (is_hopeless(double(agree) / double(count),
                  double(best.score.inliers) / double(std::ssize(left_)), count))
    model.reset();
  return model;
}

template <ModelFamily F>
void ransac_search<F>::try_samples(std::uint64_t round, index_t iteration,
                                   std::span<candidate> next, const candidate& best) const {
  std::vector<model_type> models;
  for (candidate& one : next) {
    one.model = draw(round, iteration++, best);
    if (one.model) models.push_back(*one.model);
  }
  const auto scores = score(std::move(models), best.score.value);
  std::size_t m = 0;
  for (candidate& one : next)
    if (one.model) one.score = scores[m++];
}

template <ModelFamily F>
void ransac_search<F>::improve(candidate& best) const {
  const index_t step = std::max<index_t>(1, size_ / (most_blocks_fitted * score_block_size));
  for (int k = 0; k < most_refits; ++k) {
    const auto fitted = family_.fit(inliers(*best.model, step));
    if (!fitted) return;
    const auto value = score(*fitted, best.score.value);
    if (!(value.value > best.score.value)) return;
    best = {fitted, value};
  }
}

template <ModelFamily F>
auto ransac_search<F>::finish(candidate best, index_t iterations) const
    -> std::optional<ransac_result<model_type>> {
  const index_t least = std::max<index_t>(options_.min_inliers, family_.sample_size());
  auto agree = inliers(*best.model);
  for (int k = 0; options_.refit && k < most_refits; ++k) {
    const auto fitted = family_.fit(agree);
    if (!fitted) break;
    auto others = inliers(*fitted);
    if (std::ssize(others) < std::min(least, std::ssize(agree))) break;
    const bool is_settled = others == agree;
    best.model = fitted;
    agree = std::move(others);
    if (is_settled) break;
  }
  if (std::ssize(agree) < least) return std::nullopt;
  double sum = 0;
  for (const index_t i : agree) {
    const double r = family_.residual(*best.model, i);
    sum += r * r;
  }
  const double score_now = score(*best.model, -1).value;
  const double rmse = std::sqrt(sum / double(std::ssize(agree)));
  return ransac_result<model_type>{*std::move(best.model), std::move(agree), score_now, rmse,
                                   iterations};
}

template <ModelFamily F>
auto ransac_search<F>::find(std::uint64_t round) -> std::optional<ransac_result<model_type>> {
  const index_t data = std::ssize(left_), sample_size = family_.sample_size();
  if (data < sample_size) return std::nullopt;
  preview_.clear();
  if (options_.preview > 0 && options_.preview < data)
    for (const index_t i :
         distinct_sample(data, options_.preview, random_stream{options_.seed, ~round}))
      preview_.push_back(left_[i]);

  // Samples are drawn and judged as if one after another; only the work is done ahead.
  const execution how{options_.threads, {{}, options_.monitor.stop}};
  candidate best;
  index_t iteration = 0;
  double needed = double(options_.max_iterations), reported = 0;
  std::array<candidate, most_samples_ahead> next;
  while (double(iteration) < needed) {
    // As many as have been needed so far, so that an easy search does not pay for many.
    const index_t ahead = std::min(std::max(iteration, least_samples_ahead), most_samples_ahead);
    const index_t count = std::min(ahead, options_.max_iterations - iteration);
    parallel_blocks(count, models_at_a_time, how, [&](index_t, index_t begin, index_t end) {
      try_samples(round, iteration + begin,
                  std::span{next}.subspan(static_cast<std::size_t>(begin),
                                          static_cast<std::size_t>(end - begin)),
                  best);
    });
    for (index_t k = 0; k < count && double(iteration) < needed; ++k) {
      ++iteration;
      auto& one = next[k];
      if (!one.model || one.score.inliers < sample_size || !(one.score.value > best.score.value))
        continue;
      best = std::move(one);
      if (options_.local_optimization) improve(best);
      needed = std::min(double(options_.max_iterations),
                        samples_needed(options_.confidence,
                                       double(best.score.inliers) / double(data), sample_size));
    }
    // A better model may agree with fewer data, and more samples be needed than it seemed.
    reported = std::max(reported, std::min(1.0, double(iteration) / std::max(needed, 1.0)));
    if (options_.monitor.progress && reported < 1) options_.monitor.progress(reported);
  }
  if (options_.monitor.progress) options_.monitor.progress(1);
  if (!best.model) return std::nullopt;
  return finish(std::move(best), iteration);
}

/// Random sample consensus: fits models to random samples, and returns the one that most of the
/// data agree with. Nothing if no model has enough inliers, or there are fewer data than a sample
/// needs. The result is the same for any number of threads. Throws `invalid_input` for options that
/// make no sense; `cancelled`. O(samples · N).
/// Source: Fischler & Bolles 1981, "Random sample consensus"; the score is that of Torr & Zisserman
/// 2000, "MLESAC"; the local optimisation that of Chum, Matas & Kittler 2003, "Locally optimized
/// RANSAC", in its iterated form.
export template <ModelFamily F>
[[nodiscard]] auto ransac(const F& family, const ransac_options& options)
    -> std::optional<ransac_result<typename F::model_type>> {
  return ransac_search<F>{family, options}.find(0);
}

/// Up to `count` models, one after another, each among the data that are not inliers of the models
/// before; the search ends when no model is found. Set `min_inliers`, or the last models will fit
/// only a few arbitrary data.
export template <ModelFamily F>
[[nodiscard]] auto sequential_ransac(const F& family, index_t count, const ransac_options& options)
    -> std::vector<ransac_result<typename F::model_type>> {
  expect_from(0, double(count), "sequential_ransac: the count");
  ransac_options each = options;
  each.monitor = in_passes(options.monitor, static_cast<int>(std::min<index_t>(count, 1 << 20)));
  ransac_search<F> search{family, each};
  std::vector<ransac_result<typename F::model_type>> found;
  while (std::ssize(found) < count) {
    auto next = search.find(found.size());
    if (!next) break;
    search.remove(next->inliers);
    found.push_back(*std::move(next));
  }
  if (options.monitor.progress) options.monitor.progress(1);
  return found;
}

}  // namespace cilantro
