// SPDX-License-Identifier: MIT
module;
#include "warp/kernels/row_products.hpp"
module cilantro.warp;

import cilantro.numeric;

namespace cilantro {
namespace {

/// How many lists are summed by one thread at a time, into places of their own: few enough to share
/// among threads, and many enough to meet the same nodes again and again.
constexpr index_t lists_at_once = 1024;

std::vector<std::pair<std::int32_t, std::int32_t>> pairs_of_nodes(const node_lists& lists) {
  std::vector<std::pair<std::int32_t, std::int32_t>> pairs;
  std::size_t enough = std::size_t(1) << 20;
  for (index_t i = 0; i < lists.size(); ++i) {
    const auto list = lists[i];
    for (std::size_t a = 0; a < list.size(); ++a)
      for (std::size_t b = a + 1; b < list.size(); ++b) pairs.emplace_back(list[a], list[b]);
    if (pairs.size() < enough) continue;
    // Most are there many times.
    std::ranges::sort(pairs);
    const auto rest = std::ranges::unique(pairs);
    pairs.erase(rest.begin(), rest.end());
    enough = std::max(enough, 2 * pairs.size());
  }
  return pairs;
}

}  // namespace

void row_buffer::reset(index_t unknowns) {
  unknowns_ = unknowns;
  width_ = (unknowns + detail::row_padding - 1) / detail::row_padding * detail::row_padding;
  count_ = 0;
  totals = {};
}

double* row_buffer::add(double value) {
  const index_t end = (count_ + 1) * width_;
  if (end > std::ssize(rows_)) rows_.resize(static_cast<std::size_t>(2 * end));
  if (count_ == std::ssize(values_)) values_.resize(static_cast<std::size_t>(2 * count_ + 8));
  values_[count_++] = value;
  double* const row = rows_.data() + end - width_;
  std::fill(row + unknowns_, row + width_, 0.0);
  return row;
}

/// `targets` says to which of `count` sums each entry adds; the entries of a group lie between two
/// offsets.
warp_equations::scattered warp_equations::scatter(const std::vector<std::int32_t>& targets,
                                                  const std::vector<index_t>& group_offsets,
                                                  index_t count) {
  scattered all;
  all.place_of.resize(targets.size());
  all.offsets.push_back(0);
  std::vector<std::int32_t> known(static_cast<std::size_t>(count), -1), target_of;
  for (std::size_t g = 0; g + 1 < group_offsets.size(); ++g) {
    const auto begin = all.offsets.back();
    for (index_t e = group_offsets[g]; e < group_offsets[g + 1]; ++e) {
      std::int32_t& place = known[targets[e]];
      if (place < begin) {
        place = static_cast<std::int32_t>(target_of.size());
        target_of.push_back(targets[e]);
      }
      all.place_of[e] = place;
    }
    all.offsets.push_back(std::ssize(target_of));
  }
  all.sources.assign(static_cast<std::size_t>(count) + 1, 0);
  for (const auto target : target_of) ++all.sources[target + 1];
  for (index_t i = 0; i < count; ++i) all.sources[i + 1] += all.sources[i];
  all.places.resize(target_of.size());
  auto next = all.sources;
  for (std::int32_t place = 0; place < std::ssize(target_of); ++place)
    all.places[next[target_of[place]]++] = place;
  return all;
}

warp_equations::warp_equations(index_t nodes, index_t unknowns_per_node, node_lists lists)
    : lists_{std::move(lists)},
      solver_{block_pattern{nodes, pairs_of_nodes(lists_)}, unknowns_per_node} {
  std::vector<std::int32_t> slots;
  std::vector<index_t> slot_groups, node_groups;
  for (index_t i = 0; i < lists_.size(); ++i) {
    if (i % lists_at_once == 0) {
      slot_groups.push_back(std::ssize(slots));
      node_groups.push_back(lists_.offsets[i]);
    }
    pair_offsets_.push_back(std::ssize(slots));
    const auto list = lists_[i];
    for (std::size_t a = 0; a < list.size(); ++a)
      for (std::size_t b = a; b < list.size(); ++b)
        slots.push_back(static_cast<std::int32_t>(solver_.pattern().slot(list[b], list[a])));
  }
  slot_groups.push_back(std::ssize(slots));
  node_groups.push_back(std::ssize(lists_.nodes));
  blocks_ = scatter(slots, slot_groups, solver_.pattern().blocks());
  gradient_ = scatter(lists_.nodes, node_groups, nodes);
}

const warp_sums& warp_equations::sum(const std::function<void(index_t, row_buffer&)>& write,
                                     const execution& how, equation_memory& memory) const {
  const index_t u = unknowns_per_node(), block_size = u * u;
  const auto sum_rows =
      detail::for_target(static_cast<int>(current_vector_target()),
                         []<detail::kernel_target V> { return detail::row_products_in<V>(); });
  const index_t groups = std::ssize(blocks_.offsets) - 1;
  auto& [sums, blocks, gradient, damped, step, factor] = memory;
  blocks.resize(static_cast<std::size_t>(blocks_.offsets.back() * block_size));
  gradient.resize(static_cast<std::size_t>(gradient_.offsets.back() * u));
  struct partial {
    double energy = 0;
    detail::pair_totals totals;
  };
  std::vector<partial> partials(static_cast<std::size_t>(groups));
  sums.energy = 0;
  sums.totals = {};
  sums.has_rows.assign(static_cast<std::size_t>(lists_.size()), 0);

  parallel_blocks(lists_.size(), lists_at_once, how, [&](index_t g, index_t begin, index_t end) {
    std::fill(blocks.begin() + blocks_.offsets[g] * block_size,
              blocks.begin() + blocks_.offsets[g + 1] * block_size, 0.0);
    std::fill(gradient.begin() + gradient_.offsets[g] * u,
              gradient.begin() + gradient_.offsets[g + 1] * u, 0.0);
    row_buffer rows;
    std::vector<double> products, slope;
    auto& [energy, totals] = partials[g];
    for (index_t i = begin; i < end; ++i) {
      const index_t n = std::ssize(lists_[i]);
      rows.reset(n * u);
      write(i, rows);
      totals += rows.totals;
      if (rows.count() == 0) continue;
      sums.has_rows[i] = 1;
      const index_t width = rows.width();
      products.resize(static_cast<std::size_t>(width * width));
      slope.resize(static_cast<std::size_t>(width));
      sum_rows({rows.rows(), rows.values(), rows.count(), width}, products.data(), slope.data());
      for (index_t r = 0; r < rows.count(); ++r) energy += rows.values()[r] * rows.values()[r];

      index_t entry = pair_offsets_[i];
      for (index_t a = 0; a < n; ++a) {
        double* const node = gradient.data() + gradient_.place_of[lists_.offsets[i] + a] * u;
        for (index_t k = 0; k < u; ++k) node[k] += slope[a * u + k];
        for (index_t b = a; b < n; ++b, ++entry) {
          double* const block = blocks.data() + blocks_.place_of[entry] * block_size;
          for (index_t column = 0; column < u; ++column) {
            const double* const from = products.data() + (a * u + column) * width + b * u;
            for (index_t row = a == b ? column : 0; row < u; ++row)
              block[column * u + row] += from[row];
          }
        }
      }
    }
  });

  for (const auto& [energy, totals] : partials) {
    sums.energy += energy;
    sums.totals += totals;
  }
  const auto gather = [&](const scattered& from, const buffer<double>& parts, index_t size,
                          std::vector<double>& out) {
    out.assign((from.sources.size() - 1) * static_cast<std::size_t>(size), 0);
    parallel_for(std::ssize(from.sources) - 1, {.threads = how.threads}, [&](index_t i) {
      for (index_t s = from.sources[i]; s < from.sources[i + 1]; ++s)
        for (index_t k = 0; k < size; ++k) out[i * size + k] += parts[from.places[s] * size + k];
    });
  };
  gather(blocks_, blocks, block_size, sums.blocks);
  gather(gradient_, gradient, u, sums.gradient);
  return sums;
}

const std::vector<double>& warp_equations::solve(double damping, equation_memory& memory) const {
  const index_t u = unknowns_per_node();
  const auto offsets = solver_.pattern().offsets();
  memory.damped = memory.sums.blocks;
  for (index_t node = 0; node < nodes(); ++node)
    for (index_t k = 0; k < u; ++k)
      memory.damped[offsets[node] * u * u + k * (u + 1)] *= 1 + damping;
  memory.step.resize(memory.sums.gradient.size());
  std::ranges::transform(memory.sums.gradient, memory.step.begin(), std::negate{});
  solver_.factorize(memory.damped, memory.factor);
  memory.factor.solve(memory.step);
  return memory.step;
}

}  // namespace cilantro
