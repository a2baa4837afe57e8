// SPDX-License-Identifier: MIT
#include "numeric/kernels/block_cholesky.hpp"

#include "core/vectors.hpp"

namespace cilantro::detail::CILANTRO_VECTOR_TARGET {
namespace {

constexpr bool is_widest = this_target == kernel_target::avx512;
/// What a register holds, and how many registers of rows and how many columns are summed up at
/// once. The sums are the same for any choice: each number takes its products one after the other.
constexpr int lanes = is_widest ? 8 : this_target == kernel_target::avx2 ? 4 : 2;
constexpr int tall = is_widest ? 3 : 2, wide = is_widest ? 8 : 4;
using numbers = vec<double, lanes>;

constexpr int strip = front_strip;
using whole_strip = vec<double, strip>;

/// Columns that are eliminated before what is right of them is touched: as many as stay near.
constexpr int near = 64;

/// A pivot is as good as zero below this part of what it was.
constexpr double negligible = 1e-12;

/// Calls `f.template operator()<N>()` for 0 < n = N < Most.
template <int Most, class F>
CILANTRO_ALWAYS_INLINE void with_constant(int n, const F& f) {
  if constexpr (Most > 1) {
    if (n == Most - 1) return f.template operator()<Most - 1>();
    with_constant<Most - 1>(n, f);
  }
}

// ---- Products
// -------------------------------------------------------------------------------------

/// to −= rows · columnsᵀ, of Tall registers of rows and Wide columns.
template <int Tall, int Wide, bool Fresh>
CILANTRO_ALWAYS_INLINE void subtract_tile(double* to, std::ptrdiff_t to_stride, const double* rows,
                                          const double* columns, std::ptrdiff_t stride, int depth) {
  numbers sums[Wide][Tall];
  for (int w = 0; w < Wide; ++w)
    for (int t = 0; t < Tall; ++t)
      sums[w][t] = Fresh ? numbers(0) : load<numbers>(to + w * to_stride + t * lanes);
  for (int k = 0; k < depth; ++k, rows += stride, columns += stride) {
    numbers row[Tall];
    for (int t = 0; t < Tall; ++t) row[t] = load<numbers>(rows + t * lanes);
    for (int w = 0; w < Wide; ++w) {
      const numbers factor = columns[w];
      for (int t = 0; t < Tall; ++t) sums[w][t] -= row[t] * factor;
    }
  }
  for (int w = 0; w < Wide; ++w)
    for (int t = 0; t < Tall; ++t) store(to + w * to_stride + t * lanes, sums[w][t]);
}

/// The same for any number of rows in whole strips.
template <int Wide, bool Fresh>
void subtract_rows(double* to, std::ptrdiff_t to_stride, const double* rows, const double* columns,
                   std::ptrdiff_t stride, int depth, int height) {
  int i = 0;
  for (; i + tall * lanes <= height; i += tall * lanes)
    subtract_tile<tall, Wide, Fresh>(to + i, to_stride, rows + i, columns, stride, depth);
  if constexpr (tall * lanes > strip)
    with_constant<tall>((height - i) / lanes, [&]<int Left> {
      subtract_tile<Left, Wide, Fresh>(to + i, to_stride, rows + i, columns, stride, depth);
    });
}

/// The same for up to a strip of columns.
template <bool Fresh>
CILANTRO_ALWAYS_INLINE void subtract(double* to, std::ptrdiff_t to_stride, const double* rows,
                                     const double* columns, std::ptrdiff_t stride, int depth,
                                     int height, int count) {
  for (; count >= wide; count -= wide, to += wide * to_stride, columns += wide)
    subtract_rows<wide, Fresh>(to, to_stride, rows, columns, stride, depth, height);
  with_constant<wide>(count, [&]<int Wide> {
    subtract_rows<Wide, Fresh>(to, to_stride, rows, columns, stride, depth, height);
  });
}

// ---- Elimination
// ----------------------------------------------------------------------------------

/// The square on the diagonal of a strip of columns.
int eliminate_square(double* square, std::ptrdiff_t stride, int count, const double* least) {
  alignas(64) double columns[strip][strip];
  for (int j = 0; j < count; ++j) store(columns[j], load<whole_strip>(square + j * stride));
  int undetermined = 0;
  for (int j = 0; j < count; ++j) {
    const double pivot = columns[j][j];
    // Not so for a NaN.
    const bool is_determined = pivot > least[j];
    const double inverse = is_determined ? 1 / __builtin_sqrt(pivot) : 0;
    undetermined += !is_determined;
    const whole_strip column = is_determined ? load<whole_strip>(columns[j]) * inverse : 0;
    store(columns[j], column);
    for (int c = j + 1; c < count; ++c)
      store(columns[c], load<whole_strip>(columns[c]) - column * columns[j][c]);
    for (int i = 0; i < j; ++i) columns[j][i] = 0;
    columns[j][j] = inverse;
  }
  for (int j = 0; j < count; ++j) store(square + j * stride, load<whole_strip>(columns[j]));
  return undetermined;
}

/// The rows below it.
template <int Width>
void eliminate_rows(double* rows, std::ptrdiff_t stride, const double* square, int height) {
  for (int i = 0; i < height; i += lanes) {
    numbers columns[Width];
    for (int j = 0; j < Width; ++j) {
      numbers column = load<numbers>(rows + j * stride + i);
      for (int k = 0; k < j; ++k) column -= columns[k] * square[k * stride + j];
      const double inverse = square[j * stride + j];
      columns[j] = inverse > 0 ? column * inverse : 0;
    }
    for (int j = 0; j < Width; ++j) store(rows + j * stride + i, columns[j]);
  }
}

int eliminate(const dense_front& f, const double* least) {
  const std::ptrdiff_t stride = f.panel_stride;
  const int height = f.own_rows + f.rows_below;
  int undetermined = 0;
  for (int begin = 0; begin < f.columns; begin += near) {
    const int end = smaller(begin + near, f.columns);
    for (int j = begin; j < end; j += strip) {
      double* square = f.panel + j * stride + j;
      const double* earlier = f.panel + begin * stride + j;
      const int count = smaller(strip, end - j);
      if (j > begin)
        subtract<false>(square, stride, earlier, earlier, stride, j - begin, height - j, count);
      undetermined += eliminate_square(square, stride, count, least + j);
      with_constant<strip + 1>(count, [&]<int Width> {
        eliminate_rows<Width>(square + strip, stride, square, height - j - strip);
      });
    }
    const double* done = f.panel + begin * stride;
    for (int j = end; j < f.columns; j += strip)
      subtract<false>(f.panel + j * stride + j, stride, done + j, done + j, stride, end - begin,
                      height - j, smaller(strip, f.columns - j));
    done += f.own_rows;
    for (int j = 0; j < f.rows_below; j += strip) {
      double* to = f.update + j * f.update_stride + j;
      const auto subtract_all = [&]<bool Fresh> {
        subtract<Fresh>(to, f.update_stride, done + j, done + j, stride, end - begin,
                        f.rows_below - j, strip);
      };
      if (begin == 0)
        subtract_all.template operator()<true>();
      else
        subtract_all.template operator()<false>();
    }
  }
  return undetermined;
}

// ---- Filling a front
// ------------------------------------------------------------------------------

/// The columns of a lower triangle, from the strip with the diagonal on.
void clear_columns(double* columns, std::ptrdiff_t stride, int count, int height) {
  const whole_strip zero = 0;
  for (int j = 0; j < count; ++j)
    for (int i = j / strip * strip; i < height; i += strip) store(columns + j * stride + i, zero);
}

/// Copies a block, and says whether it is finite.
template <int Block, bool Transposed>
CILANTRO_ALWAYS_INLINE bool copy_block(double* to, std::ptrdiff_t stride, const double* from,
                                       int block, bool is_lower) {
  if constexpr (Block > 0) block = Block;
  bool is_finite = true;
  for (int j = 0; j < block; ++j)
    for (int i = is_lower ? j : 0; i < block; ++i) {
      const double v = from[j * block + i];
      is_finite &= v - v == 0;
      to[Transposed ? i * stride + j : j * stride + i] = v;
    }
  return is_finite;
}

template <int Block>
bool assemble(const dense_front& f, const placed_block* blocks, std::ptrdiff_t count, int block,
              const double* values, double* least) {
  clear_columns(f.panel, f.panel_stride, f.columns, f.own_rows + f.rows_below);
  bool is_finite = true;
  for (const placed_block* b = blocks; b < blocks + count; ++b) {
    const double* from = values + b->slot * block * block;
    double* to = f.panel + b->column * f.panel_stride + b->row;
    if (b->row == b->column)
      is_finite &= copy_block<Block, false>(to, f.panel_stride, from, block, true);
    else if (b->is_transposed)
      is_finite &= copy_block<Block, true>(to, f.panel_stride, from, block, false);
    else
      is_finite &= copy_block<Block, false>(to, f.panel_stride, from, block, false);
  }
  for (int j = 0; j < f.columns; ++j)
    least[j] = negligible * larger(f.panel[j * f.panel_stride + j], 0.0);
  return is_finite;
}

bool assemble_any(const dense_front& f, const placed_block* blocks, std::ptrdiff_t count, int block,
                  const double* values, double* least) {
  switch (block) {
    case 3:
      return assemble<3>(f, blocks, count, block, values, least);
    case 6:
      return assemble<6>(f, blocks, count, block, values, least);
    case 12:
      return assemble<12>(f, blocks, count, block, values, least);
    default:
      return assemble<0>(f, blocks, count, block, values, least);
  }
}

template <class V>
CILANTRO_ALWAYS_INLINE void add_one(double*& to, const double*& from) {
  store(to, load<V>(to) + load<V>(from));
  constexpr std::size_t one = sizeof(double);
  constexpr auto numbers = static_cast<std::ptrdiff_t>(sizeof(V) / one);
  to += numbers;
  from += numbers;
}
CILANTRO_ALWAYS_INLINE void add_numbers(double* to, const double* from, int count) {
  for (; count >= strip; count -= strip) add_one<whole_strip>(to, from);
  if (count & 4) add_one<vec<double, 4>>(to, from);
  if (count & 2) add_one<vec<double, 2>>(to, from);
  if (count & 1) add_one<double>(to, from);
}

/// Adds those columns of a child's update that are in `run`, with their rows in it and in the runs
/// behind. `to` has its first row `shift` rows below that of the panel.
CILANTRO_ALWAYS_INLINE void add_columns(double* to, std::ptrdiff_t to_stride, int shift,
                                        const double* update, std::ptrdiff_t stride,
                                        const row_run* run, const row_run* end) {
  to += (run->to - shift) * to_stride;
  update += run->from * stride;
  for (int i = 0; i < run->length; ++i, to += to_stride, update += stride) {
    add_numbers(to + (run->to - shift) + i, update + run->from + i, run->length - i);
    for (const row_run* r = run + 1; r < end; ++r)
      add_numbers(to + (r->to - shift), update + r->from, r->length);
  }
}

void add_to_panel(const dense_front& f, const row_run* runs, std::ptrdiff_t count,
                  const double* update, std::ptrdiff_t stride) {
  for (const row_run* run = runs; run < runs + count; ++run)
    if (run->to < f.own_rows)
      add_columns(f.panel, f.panel_stride, 0, update, stride, run, runs + count);
}

void add_to_update(const dense_front& f, const row_run* runs, std::ptrdiff_t count,
                   const double* update, std::ptrdiff_t stride) {
  for (const row_run* run = runs; run < runs + count; ++run)
    if (run->to >= f.own_rows)
      add_columns(f.update, f.update_stride, f.own_rows, update, stride, run, runs + count);
}

// ---- Substitution
// ---------------------------------------------------------------------------------

template <int Width>
void forward_strip(const double* columns, std::ptrdiff_t stride, int height, double* x) {
  double solved[Width];
  for (int j = 0; j < Width; ++j) {
    const double inverse = columns[j * stride + j];
    solved[j] = x[j] = inverse > 0 ? x[j] * inverse : 0;
    for (int i = j + 1; i < Width; ++i) x[i] -= columns[j * stride + i] * solved[j];
  }
  for (int i = strip; i < height; i += lanes) {
    numbers sum = load<numbers>(x + i);
    for (int j = 0; j < Width; ++j) sum -= load<numbers>(columns + j * stride + i) * solved[j];
    store(x + i, sum);
  }
}

void forward(const front_shape& f, const double* panel, double* own, const std::int32_t* rows,
             int count, int block, double* x, double* work) {
  const int height = f.own_rows + f.rows_below;
  for (int i = 0; i < f.columns; ++i) work[i] = own[i];
  for (int i = f.columns; i < height; ++i) work[i] = 0;
  for (int j = 0; j < f.columns; j += strip)
    with_constant<strip + 1>(smaller(strip, f.columns - j), [&]<int Width> {
      forward_strip<Width>(panel + j * f.panel_stride + j, f.panel_stride, height - j, work + j);
    });
  for (int i = 0; i < f.columns; ++i) own[i] = work[i];
  const double* from = work + f.own_rows;
  for (int r = 0; r < count; ++r, from += block) {
    double* to = x + static_cast<std::ptrdiff_t>(rows[r]) * block;
    for (int i = 0; i < block; ++i) to[i] += from[i];
  }
}

CILANTRO_ALWAYS_INLINE double sum_of(whole_strip v) {
  const auto four = v.lo + v.hi;
  const auto two = four.lo + four.hi;
  return two.x + two.y;
}

/// Subtracts from each x what the rows below its strip say. Products are summed in as many numbers
/// on all targets.
template <int Width>
CILANTRO_ALWAYS_INLINE void subtract_below(const double* columns, std::ptrdiff_t stride, int height,
                                           const double* below, double* x) {
  whole_strip sums[Width] = {};
  for (int i = 0; i < height; i += strip) {
    const whole_strip row = load<whole_strip>(below + i);
    for (int j = 0; j < Width; ++j) sums[j] += load<whole_strip>(columns + j * stride + i) * row;
  }
  for (int j = 0; j < Width; ++j) x[j] -= sum_of(sums[j]);
}

void backward_strip(const double* square, std::ptrdiff_t stride, int height, int count, double* x) {
  // As many columns at once as sums fit into registers.
  int done = 0;
  for (; done + lanes <= count; done += lanes)
    subtract_below<lanes>(square + done * stride + strip, stride, height - strip, x + strip,
                          x + done);
  with_constant<lanes>(count - done, [&]<int Width> {
    subtract_below<Width>(square + done * stride + strip, stride, height - strip, x + strip,
                          x + done);
  });
  for (int j = count - 1; j >= 0; --j) {
    for (int i = j + 1; i < count; ++i) x[j] -= square[j * stride + i] * x[i];
    x[j] *= square[j * stride + j];
  }
}

void backward(const front_shape& f, const double* panel, double* own, const std::int32_t* rows,
              int count, int block, const double* x, double* work) {
  const int height = f.own_rows + f.rows_below;
  for (int i = 0; i < f.columns; ++i) work[i] = own[i];
  for (int i = f.columns; i < height; ++i) work[i] = 0;
  double* to = work + f.own_rows;
  for (int r = 0; r < count; ++r, to += block) {
    const double* from = x + static_cast<std::ptrdiff_t>(rows[r]) * block;
    for (int i = 0; i < block; ++i) to[i] = from[i];
  }
  for (int j = (f.columns - 1) / strip * strip; j >= 0; j -= strip)
    backward_strip(panel + j * f.panel_stride + j, f.panel_stride, height - j,
                   smaller(strip, f.columns - j), work + j);
  for (int i = 0; i < f.columns; ++i) own[i] = work[i];
}

}  // namespace
}  // namespace cilantro::detail::CILANTRO_VECTOR_TARGET

namespace cilantro::detail {

using namespace CILANTRO_VECTOR_TARGET;

template <kernel_target V>
block_cholesky_kernels block_cholesky_kernels_in() {
  return {assemble_any, add_to_panel, eliminate, add_to_update, forward, backward};
}
template block_cholesky_kernels block_cholesky_kernels_in<this_target>();

}  // namespace cilantro::detail
