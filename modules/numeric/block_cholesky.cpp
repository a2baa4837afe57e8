// SPDX-License-Identifier: MIT
module;
#include "numeric/kernels/block_cholesky.hpp"
module cilantro.numeric;

import :elimination;

namespace cilantro {
namespace {

detail::block_cholesky_kernels kernels() {
  return detail::for_target(static_cast<int>(current_vector_target()), []<detail::kernel_target V> {
    return detail::block_cholesky_kernels_in<V>();
  });
}

}  // namespace

block_cholesky::block_cholesky(block_pattern pattern, index_t block_size) {
  expects(0 < block_size, "block_cholesky: a block has at least one row");
  expects(pattern.nodes() <= std::numeric_limits<std::int32_t>::max() / block_size,
          "block_cholesky: there can be at most 2^31 - 1 unknowns");
  order_ = analyzed(std::move(pattern), block_size);
}

const block_pattern& block_cholesky::pattern() const {
  return order_->pattern;
}
index_t block_cholesky::block_size() const {
  return order_->block;
}
index_t block_cholesky::size() const {
  return order_->pattern.nodes() * order_->block;
}

block_factor block_cholesky::factorize(std::span<const double> values) const {
  block_factor made;
  factorize(values, made);
  return made;
}

void block_cholesky::factorize(std::span<const double> values, block_factor& reused) const {
  const elimination& e = *order_;
  reused.order_ = nullptr;
  reused.size_ = reused.undetermined_ = 0;
  expects(std::ssize(values) == e.pattern.blocks() * e.block * e.block,
          "block_cholesky: there must be as many values as the pattern has");
  reused.factor_.resize(e.factor_size);
  reused.scratch_.resize(e.scratch_size + e.most_columns);
  double* scratch = reused.scratch_.data();
  double* least = scratch + e.scratch_size;
  const auto kernel = kernels();
  for (const front& f : e.fronts) {
    const detail::dense_front whole{f.shape, reused.factor_.data() + f.panel, scratch + f.update};
    expects(kernel.assemble(whole, e.blocks.data() + f.blocks, f.blocks_end - f.blocks,
                            static_cast<int>(e.block), values.data(), least),
            "block_cholesky: all values must be finite");
    const auto add_children = [&](const auto& add) {
      for (auto c = f.child; c >= 0; c = e.fronts[c].sibling) {
        const front& child = e.fronts[c];
        add(whole, e.runs.data() + child.runs, child.runs_end - child.runs, scratch + child.update,
            child.shape.update_stride);
      }
    };
    add_children(kernel.add_to_panel);
    reused.undetermined_ += kernel.eliminate(whole, least);
    add_children(kernel.add_to_update);
  }
  // Only rows of undetermined unknowns can have overflowed, and these are 0 whatever they hold.
  if (reused.undetermined_ > 0)
    for (double& v : reused.factor_)
      if (!std::isfinite(v)) v = 0;
  reused.order_ = order_;
  reused.size_ = size();
}

void block_factor::solve(std::span<double> right_side) const {
  expects(std::ssize(right_side) == size_,
          "block_factor::solve: the right side must have as many numbers as there are unknowns");
  if (size_ == 0) return;
  const elimination& e = *order_;
  const index_t block = e.block, nodes = e.pattern.nodes();
  std::vector<double> x(size_ + e.most_rows);
  double* work = x.data() + size_;
  for (index_t i = 0; i < nodes; ++i)
    std::copy_n(right_side.begin() + e.nodes[i] * block, block, x.begin() + i * block);
  const auto kernel = kernels();
  const auto substitute = [&](const front& f, const auto& step) {
    step(f.shape, factor_.data() + f.panel, x.data() + f.first * block, e.rows.data() + f.rows,
         static_cast<int>(f.rows_end - f.rows), static_cast<int>(block), x.data(), work);
  };
  for (const front& f : e.fronts) substitute(f, kernel.forward);
  for (const front& f : e.fronts | std::views::reverse) substitute(f, kernel.backward);
  for (index_t i = 0; i < nodes; ++i)
    std::copy_n(x.begin() + i * block, block, right_side.begin() + e.nodes[i] * block);
}

}  // namespace cilantro
