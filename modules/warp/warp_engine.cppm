// SPDX-License-Identifier: MIT
module;
#include "core/closed_spaces.hpp"
export module cilantro.warp:warp_engine;

import cilantro.standard;
import cilantro.core;
import cilantro.search;
import cilantro.registration;
import :deformation_graph;
import :warp_equations;
import :warp_field;

namespace cilantro {

/// What keeps the motions of linked nodes alike.
export enum class warp_regularizer {
  /// Linked nodes agree on where each of them is: the shape is remembered, however far it moves.
  /// For rigid motions, the as-rigid-as-possible energy of Sorkine & Alexa 2007 on the graph.
  shape,
  /// Linked nodes move alike in each iteration, as in a viscous fluid: what iterations before have
  /// bent costs nothing.
  increments,
};

/// Beyond it, rounding would hide what moves all nodes together.
inline constexpr double most_stiffness = 1e9;

/// Options of a `warp_estimator`.
export struct warp_options {
  /// How much the mean squared disagreement of linked nodes counts, relative to the mean squared
  /// residual of the source points. It has no unit, and depends neither on the number of points nor
  /// on that of nodes. From 0 to 10⁹.
  double stiffness = 1;
  robust_kernel robust = {};  ///< Of the length of residuals, on top of those of the metric.
  /// Of the disagreement of linked nodes, in the units of the points. Not with
  /// `warp_regularizer::increments`, which begin with none.
  robust_kernel smoothness = {};
  warp_regularizer regularizer = warp_regularizer::shape;  ///< What is kept alike.
  /// How much the linear parts of nodes that may deform are held to rotations, relative to
  /// `stiffness`: (AᵀA − I) times the mean length of links is a residual of each node. Must be 0
  /// for rigid motions. Source: Sumner, Schmid & Pauly 2007, equation 5.
  double rigidity = 0;
  int threads = 0;
};

/// Throws `invalid_input` for options that make no sense.
void expect_valid(const warp_options& options, bool is_rigid);

/// The nodes of the points with the same anchors, of each link, and, for `with_rigidity`, each
/// node.
template <Scalar S, int D>
[[nodiscard]] node_lists lists_of_nodes(const deformation_graph_data<S, D>& graph,
                                        bool with_rigidity);

/// The motion that unknowns about a node stand for. That of rigid motions in 3D, which most are, in
/// closed form.
template <int D, MotionModel Motion>
[[nodiscard]] affine_parts<double, D> step_around(const Motion& motion,
                                                  const Eigen::VectorXd& unknowns,
                                                  index_t dimension) {
  if constexpr (D == 3 && std::same_as<Motion, rigid_motion>) {
    // With the cross product by half of the rotation as A, (1 − A)⁻¹ (1 + A).
    const Eigen::Vector3d half = unknowns.head<3>() / 2;
    Eigen::Matrix3d cross;
    cross << 0, -half[2], half[1], half[2], 0, -half[0], -half[1], half[0], 0;
    const Eigen::Matrix3d inverse =
        (Eigen::Matrix3d::Identity() + cross + half * half.transpose()) / (1 + half.squaredNorm());
    return {inverse * (Eigen::Matrix3d::Identity() + cross), inverse * unknowns.tail<3>()};
  } else {
    const motion_step step = motion.step(unknowns, dimension);
    return {step.linear, step.translation};
  }
}

/// The weights of the disagreements along links, from the first node and from the second.
struct link_weights {
  std::vector<double> forward, backward;
};

/// What a `warp_estimator` makes small, in squared units of the points.
export struct warp_energy {
  double residuals = 0;     ///< Σ w r² / N.
  double disagreement = 0;  ///< stiffness · Σ ω ‖e‖² / L, and what `rigidity` adds.
  /// The nodes that no pair reaches.
  index_list unsupported_nodes;

  /// The sum of both.
  [[nodiscard]] double total() const { return residuals + disagreement; }
};

/// What an estimator keeps from one step to the next, so that memory is allocated once.
struct warp_memory {
  warp_energy energy;  ///< Of the field before the last step.
  equation_memory equations;
  link_weights links;
  /// By list of pairs: the weights of each pair in each term, and where the pairs of each source
  /// point begin.
  std::vector<std::vector<double>> weights;
  std::vector<std::vector<std::int32_t>> first;
  buffer<double> places;  ///< Where each source point with pairs is.
};

/// Everything that does not depend on the metric. `Motion` gives the unknowns of a node.
template <Scalar S, int D, MotionModel Motion>
class warp_engine {
 public:
  using motions_type = node_motions<D>;
  using vector = point_vector<double, D>;
  using matrix = Eigen::Matrix<double, D, D>;

  warp_engine(std::shared_ptr<const deformation_graph_data<S, D>> graph, Motion motion,
              const warp_options& options);
  /// The same with other options.
  warp_engine(const warp_engine& other, const warp_options& options);

  [[nodiscard]] const deformation_graph_data<S, D>& graph() const { return *graph_; }
  [[nodiscard]] const warp_options& options() const { return options_; }

  /// Writes the derivatives of a residual of point number `i` of a group, with that gradient,
  /// acting `beside` the moved point.
  void write_row(const moved_group& moved, index_t group, index_t i, const vector& gradient,
                 const vector* beside, double scale, double* row) const {
    const double* const weights = graph_->weights_at(graph_->groups[group] + i);
    const index_t u = equations_->unknowns_per_node();
    for (index_t k = 0; k < moved.anchors; ++k, row += u) {
      const vector scaled = scale * weights[k] * gradient;
      const auto offset = moved.template offset<D>(i, k, gradient.size());
      motion_.pull_back(beside ? vector{offset + *beside} : vector{offset}, scaled, row);
    }
  }

  /// Writes the rows of a list of the metric.
  using data_writer = std::function<void(index_t list, row_buffer& rows)>;
  /// The weighted sum of squared residuals under other motions, and how far points move at most.
  struct outcome {
    double energy = 0, farthest = 0;
  };
  using data_judge = std::function<outcome(const motions_type& motions)>;

  /// What is made small, and what that is made of.
  struct assessment {
    detail::pair_totals totals;
    double energy = 0;        ///< Of residuals and regulariser, not divided.
    double disagreement = 0;  ///< The part of the regulariser.
    index_list unsupported_nodes;
  };
  assessment assess(const motions_type& current, const data_writer& write,
                    warp_memory& memory) const;

  /// The step from `current`, with `judge` to say whether it makes the energy smaller.
  struct step {
    motions_type motions;
    assessment before;
    transform_change change;
  };
  [[nodiscard]] step improve(const motions_type& current, const data_writer& write,
                             const data_judge& judge, warp_memory& memory) const;
  /// What the energies are divided by.
  [[nodiscard]] double points() const { return double(graph_->order.size()); }

 private:
  void set(const warp_options& options);
  void write_link(const motions_type& motions, index_t link, link_weights& weights,
                  row_buffer& rows) const;
  void write_rigidity(const motions_type& motions, std::int32_t node, row_buffer& rows) const;
  [[nodiscard]] vector disagreement(const motions_type& motions, std::int32_t from,
                                    std::int32_t to) const;
  [[nodiscard]] double regularity(const motions_type& motions, const motions_type& before,
                                  const link_weights& weights) const;
  [[nodiscard]] motions_type moved(const motions_type& motions, const std::vector<double>& unknowns,
                                   transform_change& change) const;

  std::shared_ptr<const deformation_graph_data<S, D>> graph_;
  Motion motion_;
  warp_options options_;
  index_t data_lists_ = 0;
  double link_weight_ = 0, rigidity_weight_ = 0;
  double mean_link_ = 0;
  std::shared_ptr<const warp_equations> equations_;
};

template <Scalar S, int D, MotionModel Motion>
warp_engine<S, D, Motion>::warp_engine(std::shared_ptr<const deformation_graph_data<S, D>> graph,
                                       Motion motion, const warp_options& options)
    : graph_{std::move(graph)}, motion_{std::move(motion)} {
  set(options);
}
template <Scalar S, int D, MotionModel Motion>
warp_engine<S, D, Motion>::warp_engine(const warp_engine& other, const warp_options& options)
    : warp_engine{other} {
  set(options);
}

template <Scalar S, int D, MotionModel Motion>
void warp_engine<S, D, Motion>::set(const warp_options& options) {
  expect_valid(options, RigidMap<transform_of<Motion, double, D>>);
  // Which sums there are depends on whether nodes have rows of their own, and on nothing else here.
  if (!equations_ || (options.rigidity > 0) != (options_.rigidity > 0))
    equations_ = std::make_shared<const warp_equations>(
        index_t(graph_->nodes.cols()), Motion::unknowns(index_t(graph_->nodes.rows())),
        lists_of_nodes(*graph_, options.rigidity > 0));
  options_ = options;
  data_lists_ = graph_->group_count();
  double length = 0;
  for (const auto& [a, b] : graph_->links)
    length += (graph_->nodes.col(a) - graph_->nodes.col(b)).template cast<double>().norm();
  const auto links = double(graph_->links.size());
  // Without links, what is left to compare with is how far a node reaches.
  mean_link_ = links > 0 ? length / links : std::isfinite(graph_->reach) ? graph_->reach : 1;
  link_weight_ = links > 0 ? options.stiffness * points() / (2 * links) : 0;
  rigidity_weight_ = options.rigidity * options.stiffness * points() / double(graph_->nodes.cols());
}

/// How node `from` would move node `to`, compared with where that one goes.
template <Scalar S, int D, MotionModel Motion>
auto warp_engine<S, D, Motion>::disagreement(const motions_type& motions, std::int32_t from,
                                             std::int32_t to) const -> vector {
  const vector across = (graph_->nodes.col(to) - graph_->nodes.col(from)).template cast<double>();
  return motions.linear_of(from) * across - across + motions.shifts.col(from) -
         motions.shifts.col(to);
}

template <Scalar S, int D, MotionModel Motion>
void warp_engine<S, D, Motion>::write_link(const motions_type& motions, index_t link,
                                           link_weights& weights, row_buffer& rows) const {
  const auto [first, second] = graph_->links[link];
  const index_t u = equations_->unknowns_per_node(), d = motions.shifts.rows();
  const vector none = vector::Zero(d);
  for (const bool is_forward : {true, false}) {
    const std::int32_t from = is_forward ? first : second, to = is_forward ? second : first;
    const vector rest =
        options_.regularizer == warp_regularizer::shape ? disagreement(motions, from, to) : none;
    const double weight = link_weight_ * options_.smoothness(rest.norm());
    detail::expect_weight(weight);
    (is_forward ? weights.forward : weights.backward)[link] = weight;
    if (weight == 0) continue;
    const double scale = std::sqrt(weight);
    const vector offset = motions.linear_of(from) *
                          (graph_->nodes.col(to) - graph_->nodes.col(from)).template cast<double>();
    for (index_t axis = 0; axis < d; ++axis) {
      double* const row = rows.add(scale * rest[axis]);
      const vector along = scale * vector::Unit(d, axis);
      motion_.pull_back(offset, along, row + (is_forward ? 0 : u));
      motion_.pull_back(none, vector{-along}, row + (is_forward ? u : 0));
    }
  }
}

template <Scalar S, int D, MotionModel Motion>
void warp_engine<S, D, Motion>::write_rigidity(const motions_type& motions, std::int32_t node,
                                               row_buffer& rows) const {
  const auto linear = motions.linear_of(node);
  const index_t u = equations_->unknowns_per_node(), d = motions.shifts.rows();
  const double scale = std::sqrt(rigidity_weight_) * mean_link_;
  const vector none = vector::Zero(d);
  std::vector<double> part(static_cast<std::size_t>(u));
  for (index_t a = 0; a < d; ++a)
    for (index_t b = a; b < d; ++b) {
      const vector from = linear.col(a), to = linear.col(b);
      // Off the diagonal a residual stands for two equal ones.
      const double twice = a == b ? scale : scale * std::sqrt(2.0);
      double* const row = rows.add(twice * (from.dot(to) - (a == b)));
      for (index_t k = 0; k < u; ++k) row[k] = 0;
      const auto add = [&](const vector& at, const vector& gradient) {
        motion_.pull_back(at, vector{twice * gradient}, part.data());
        for (index_t k = 0; k < u; ++k) row[k] += part[k];
        motion_.pull_back(none, vector{twice * gradient}, part.data());
        for (index_t k = 0; k < u; ++k) row[k] -= part[k];
      };
      add(from, to);
      add(to, from);
    }
}

/// What the regulariser adds to the energy, with the weights that it had.
template <Scalar S, int D, MotionModel Motion>
double warp_engine<S, D, Motion>::regularity(const motions_type& motions,
                                             const motions_type& before,
                                             const link_weights& weights) const {
  double sum = 0;
  const bool is_shape = options_.regularizer == warp_regularizer::shape;
  for (std::size_t link = 0; link < graph_->links.size(); ++link) {
    const auto [a, b] = graph_->links[link];
    const auto square = [&](std::int32_t from, std::int32_t to) {
      const vector rest = disagreement(motions, from, to);
      return is_shape ? rest.squaredNorm() : (rest - disagreement(before, from, to)).squaredNorm();
    };
    sum += weights.forward[link] * square(a, b) + weights.backward[link] * square(b, a);
  }
  if (options_.rigidity > 0)
    for (std::int32_t node = 0; node < graph_->nodes.cols(); ++node) {
      const matrix linear = motions.linear_of(node);
      const matrix rest =
          linear.transpose() * linear - matrix::Identity(linear.rows(), linear.cols());
      sum += rigidity_weight_ * mean_link_ * mean_link_ * rest.squaredNorm();
    }
  return sum;
}

template <Scalar S, int D, MotionModel Motion>
auto warp_engine<S, D, Motion>::moved(const motions_type& motions,
                                      const std::vector<double>& unknowns,
                                      transform_change& change) const -> motions_type {
  const index_t u = equations_->unknowns_per_node(), d = motions.shifts.rows();
  motions_type result = motions;
  for (index_t k = 0; k < equations_->nodes(); ++k) {
    const Eigen::Map<const Eigen::VectorXd> own{unknowns.data() + k * u, u};
    if (own.isZero(0)) continue;
    const auto step = step_around<D>(motion_, own, d);
    const matrix linear = step.linear;
    matrix turned = linear * motions.linear_of(k);
    if constexpr (RigidMap<transform_of<Motion, double, D>>)
      // One step towards the nearest rotation, which rounding has left by little.
      turned = turned * (1.5 * matrix::Identity(d, d) - 0.5 * turned.transpose() * turned);
    else if constexpr (requires { motion_.normalize(turned); })
      turned = motion_.normalize(turned);
    result.linear_of(k) = turned;
    result.shifts.col(k) += step.translation;
    change.rotation =
        std::max(change.rotation, (linear - matrix::Identity(d, d)).norm() / std::sqrt(2.0));
    change.translation = std::max(change.translation, step.translation.norm());
  }
  return result;
}

template <Scalar S, int D, MotionModel Motion>
auto warp_engine<S, D, Motion>::assess(const motions_type& current, const data_writer& write,
                                       warp_memory& memory) const -> assessment {
  const index_t links = std::ssize(graph_->links);
  memory.links.forward.assign(graph_->links.size(), 0);
  memory.links.backward.assign(graph_->links.size(), 0);
  const warp_sums& sums = equations_->sum(
      [&](index_t list, row_buffer& rows) {
        if (list < data_lists_)
          write(list, rows);
        else if (list < data_lists_ + links)
          write_link(current, list - data_lists_, memory.links, rows);
        else
          write_rigidity(current, static_cast<std::int32_t>(list - data_lists_ - links), rows);
      },
      {.threads = options_.threads}, memory.equations);

  assessment found{sums.totals, sums.energy, regularity(current, current, memory.links), {}};
  std::vector<char> is_reached(static_cast<std::size_t>(equations_->nodes()), 0);
  for (index_t list = 0; list < data_lists_; ++list)
    if (sums.has_rows[list])
      for (const auto node : equations_->lists()[list]) is_reached[node] = 1;
  for (std::int32_t node = 0; node < equations_->nodes(); ++node)
    if (!is_reached[node]) found.unsupported_nodes.push_back(node);
  return found;
}

template <Scalar S, int D, MotionModel Motion>
auto warp_engine<S, D, Motion>::improve(const motions_type& current, const data_writer& write,
                                        const data_judge& judge, warp_memory& memory) const
    -> step {
  step found{current, assess(current, write, memory), {}};
  double farthest = 0;
  for (index_t k = 0; k < equations_->nodes(); ++k)
    farthest = std::max(farthest, graph_->nodes.col(k).template cast<double>().norm());
  found.change.rounding = 4 * double(std::numeric_limits<S>::epsilon()) * farthest;
  // Without residuals a field stays, though linked nodes may disagree.
  if (!(found.before.totals.weight > 0)) return found;
  // Rounding must not determine what nothing else does, so that there is always a little damping;
  // of stiff nodes it would also slow down what all of them do together.
  double damping = std::max(1e-8 / std::max(1.0, options_.stiffness), 1e-14);
  constexpr int most_attempts = 7;
  for (int attempt = 0; attempt < most_attempts; ++attempt, damping *= 100) {
    transform_change change{.rounding = found.change.rounding};
    auto motions = moved(current, equations_->solve(damping, memory.equations), change);
    const auto [energy, moved_by] = judge(motions);
    change.translation = std::max(change.translation, moved_by);
    // A step that is refused has not converged: it is said how far it would have gone.
    if (attempt == 0) found.change = change;
    if (!(energy + regularity(motions, current, memory.links) <= found.before.energy * (1 + 1e-12)))
      continue;
    found.change = change;
    found.motions = std::move(motions);
    break;
  }
  return found;
}

#define CILANTRO_COMPILED_ELSEWHERE(S, D)                \
  extern template class warp_engine<S, D, rigid_motion>; \
  extern template class warp_engine<S, D, affine_motion>;
CILANTRO_FOR_CLOSED_SPACES(CILANTRO_COMPILED_ELSEWHERE)
#undef CILANTRO_COMPILED_ELSEWHERE

}  // namespace cilantro
