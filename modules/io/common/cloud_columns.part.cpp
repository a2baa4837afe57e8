// SPDX-License-Identifier: MIT
//
// A cloud as the columns of a file. Internal: shared by the writers.
module;
#include "io/common/number.hpp"
module cilantro.io:cloud_columns;

import cilantro.standard;
import cilantro.core;
import cilantro.cloud;

namespace cilantro {

/// A column of a file: its name, and the strided numbers that it is written from.
struct file_column {
  enum class form {
    plain,
    eight_bit,  ///< A colour in [0, 1] that is written as 0 to 255.
    packed,     ///< Three adjacent colours that are written as one integer of 32 bits.
    shifted,    ///< A coordinate that is written in double, with an offset added.
  };

  std::string name;
  std::variant<const std::int8_t*, const std::uint8_t*, const std::int16_t*, const std::uint16_t*,
               const std::int32_t*, const std::uint32_t*, const float*, const double*,
               const std::int64_t*, const std::uint64_t*>
      data;
  index_t stride = 1;
  form as = form::plain;
  double offset = 0;

  [[nodiscard]] detail::number type() const;
};

/// What a format calls normals and colours, and how it holds the latter.
struct column_style {
  std::string_view normal_prefix = "n";
  enum class colors { eight_bit, floating, packed } colors = colors::eight_bit;
};

template <Scalar S, int D>
std::vector<file_column> columns_of(const point_cloud<S, D>& cloud, const column_style& style);

/// Throws `invalid_input` naming `who` for a name that is empty or has white space or one of
/// `forbidden`, or that comes twice.
void expect_writable_names(const std::vector<file_column>& columns, const char* who,
                           std::string_view forbidden = "");

[[nodiscard]] std::size_t record_size(const std::vector<file_column>& columns);
/// The records `first` to `first + n` − 1 as bytes; each loop fills one column.
void encode_records(const std::vector<file_column>& columns, index_t first, index_t n,
                    std::size_t record, bool swap, char* out);
/// One column of them, `step` bytes apart.
void encode_column(const file_column& column, index_t first, index_t n, std::size_t step, bool swap,
                   char* out);
/// Record `i` as a line of text, with as many digits as reading it back exactly needs.
void encode_line(const std::vector<file_column>& columns, index_t i, char separator,
                 std::string& text);

/// Calls `write(text)` with pieces of the text of all records, and `watch` in between.
void encode_text(const std::vector<file_column>& columns, index_t size, char separator,
                 const task_monitor& monitor, const std::function<void(std::string_view)>& write);
/// As above, of the records as bytes.
void encode_binary(const std::vector<file_column>& columns, index_t size, bool swap,
                   const task_monitor& monitor, const std::function<void(std::string_view)>& write);

}  // namespace cilantro
