// SPDX-License-Identifier: MIT
module;
#include <cerrno>

#include "io/common/byte_stream.hpp"
#include "io/common/file.hpp"
#include "io/common/number.hpp"
module cilantro.io;

import :cloud_builder;
import :cloud_columns;
import :cloud_source;
import :file_scope;
import :line_blocks;
import :number_rows;

namespace cilantro {
namespace {

using detail::byte_stream;
using detail::number;
using detail::word_reader;
using names = std::vector<std::string>;

/// More columns than any exporter writes; a line of many numbers is not a point.
constexpr std::size_t most_columns = 4096;

names words_of(std::string_view line) {
  names all;
  word_reader words{line, true};
  for (auto word = words.next(); !word.empty(); word = words.next()) {
    if (word.size() > 2 && word.front() == '"' && word.back() == '"')
      word = word.substr(1, word.size() - 2);
    all.emplace_back(word);
  }
  return all;
}

bool is_number(std::string_view word) {
  double value;
  return detail::parse_number(word, value);
}

/// The words of a line that blanks separate, commas being part of them.
names words_between_blanks(std::string_view line) {
  names all;
  word_reader words{line};
  for (auto word = words.next(); !word.empty(); word = words.next()) all.emplace_back(word);
  return all;
}

/// Whether a word is a number such as `1,5`: with one comma, between digits.
bool has_decimal_comma(std::string_view word) {
  const auto is_digit = [](char c) { return '0' <= c && c <= '9'; };
  const auto at = word.find(',');
  if (at == word.npos || at == 0 || at + 1 == word.size() || !is_digit(word[at - 1]) ||
      !is_digit(word[at + 1]))
    return false;
  std::string number{word};
  number[at] = '.';
  return is_number(number);
}

/// Whether words are names of columns: the coordinates are among them.
template <int D>
bool are_names(const names& words) {
  const auto has = [&](std::string_view name) {
    return std::ranges::any_of(words, [&](const auto& word) { return same_name(word, name); });
  };
  return has("x") && has("y") && (D == 2 || has("z"));
}

template <Scalar S, int D>
class text_reader {
 public:
  text_reader(byte_stream& in, const text_read_options& options) : in_{in}, options_{options} {}

  /// The next points, up to `most` of them, of which the first say what the columns are.
  point_cloud<S, D> read(index_t most = std::numeric_limits<index_t>::max(),
                         piece_agreement<D>* agreement = nullptr) {
    rows_before_ += rows_;
    rows_ = 0;
    read_rows(most);
    if (fields_.empty()) fields_ = describe();
    cloud_builder<S, D> builder{fields_, options_.origin, cloud_builder<S, D>::style::text};
    if (agreement != nullptr) builder.agree_with(*agreement);
    expects(builder.has_points() || options_.columns.empty(),
            D == 2 ? "read_text: the columns must name x and y"
                   : "read_text: the columns must name x, y and z");
    if (!builder.has_points())
      in_.fail_at_line(D == 2          ? "the points have no x and y"
                       : columns_ == 2 ? "the points have two coordinates, and three are asked for"
                                       : "the points have no x, y and z");
    builder.resize(rows_);
    parallel_blocks(rows_, values_.block_rows(), {.threads = options_.threads},
                    [&](index_t, index_t begin, index_t end) { store(builder, begin, end); });
    values_.reset(columns_);
    return builder.finish(std::exchange(comments_, {}));
  }

 private:
  void store(cloud_builder<S, D>& builder, index_t begin, index_t end) const {
    for (std::size_t c = 0; c < columns_; ++c) {
      if (fields_[c].type == number::float64) {
        const auto* const first = reinterpret_cast<const char*>(values_[begin] + c);
        builder.store_column(c, begin, end - begin, first, columns_ * sizeof(double), false);
        continue;
      }
      for (index_t i = begin; i < end; ++i) {
        const double v = value(i, c);
        if (!is_byte(v))
          in_.fail_at_line(
              "the colours of the points up to here are not whole numbers from 0 to "
              "255, as those of the first points are");
        builder.store(c, i, static_cast<std::uint8_t>(v));
      }
    }
  }

  [[nodiscard]] double value(index_t row, std::size_t column) const { return values_[row][column]; }

  void read_rows(index_t most) {
    if (in_.position() == 0) in_.skip_byte_order_mark();
    line_blocks blocks{in_, options_.threads, 2 * std::max<std::size_t>(1, columns_)};
    for (index_t line_by_line = 0; rows_ < most;) {
      if (columns_ > 0 && line_by_line <= 0) {
        line_by_line = take_rows(blocks, most);
        if (line_by_line == 0) continue;
      }
      --line_by_line;
      const auto line = in_.take_line();
      if (!line) break;
      if (lines_++ % 4096 == 0) watch(options_.monitor, double(in_.position()), double(in_.size()));
      if (is_comment(*line)) continue;
      if (rows_before_ + rows_ == count_.value_or(-1)) {
        const auto words = words_of(*line);
        if (words.empty() || take_count(words)) continue;
        comments_.push_back("the file goes on after the " + std::to_string(*count_) +
                            " points that it says it has");
        break;
      }
      if (columns_ > 0 ? take_row(*line) : take_first_row(*line)) ++rows_;
      if (rows_ == std::numeric_limits<std::int32_t>::max())
        in_.fail_at_line("there are more than 2^31 - 1 points");
    }
    if (const index_t all = rows_before_ + rows_; rows_ < most && all < count_.value_or(0))
      in_.fail_at_line("the file ends after " + std::to_string(all) + " points, and says it has " +
                       std::to_string(*count_));
  }

  /// Takes rows by several threads. How many lines had better be taken one by one after that: those
  /// that come next are few, or need a closer look, and more like that may follow.
  index_t take_rows(line_blocks& blocks, index_t most) {
    watch(options_.monitor, double(in_.position()), double(in_.size()));
    index_t wanted = std::min<index_t>(most, std::numeric_limits<std::int32_t>::max() - 1) - rows_;
    if (count_) wanted = std::min(wanted, *count_ - rows_before_ - rows_);
    const auto read = blocks.read(
        wanted, [](std::string_view line) { return !is_blank(line); },
        [&](index_t rows) { values_.resize(rows_ + rows); },
        [&](auto& lines, index_t first, index_t n) {
          std::string copy;
          for (index_t i = 0; i < n;) {
            const auto before = lines;
            const auto line = lines.take_line();
            if (is_blank(*line)) continue;
            const bool is_plain =
                !comment_of(*line) && (has_decimal_commas_ || line->find(',') == line->npos);
            if (!is_plain || !parse_row(*line, copy, values_[rows_ + first + i]).empty()) {
              lines = before;
              return i;
            }
            ++i;
          }
          return n;
        });
    if (!read) return blocks.few;
    rows_ += read->count;
    return read->is_stopped ? 16 * blocks.few : 0;
  }

  /// Before the points of each scan in a PTS file: how many they are. False if it is something
  /// else.
  bool take_count(const names& words) {
    std::uint32_t more = 0;
    if (words.size() > 1 || !detail::parse_number(words[0], more)) return false;
    // A point takes at least as many digits and separators as it has coordinates.
    if (more > in_.remaining() / (2 * D - 1) + 1)
      in_.fail_at_line("the file says that it has more points than fit it");
    count_ = count_.value_or(0) + more;
    return true;
  }

  /// What a line says after # or //, if it begins so.
  static std::optional<std::string_view> comment_of(std::string_view line) {
    while (!line.empty() && (line.front() == ' ' || line.front() == '\t')) line.remove_prefix(1);
    const bool slashes = line.starts_with("//");
    if (!slashes && !line.starts_with('#')) return std::nullopt;
    line.remove_prefix(slashes ? 2 : 1);
    if (line.starts_with(' ')) line.remove_prefix(1);
    return line;
  }

  bool is_comment(std::string_view line) {
    const auto comment = comment_of(line);
    if (comment) comments_.emplace_back(*comment);
    return comment.has_value();
  }

  /// Appends the values of a line; false if it is blank.
  bool take_row(std::string_view line) {
    if (!has_decimal_commas_ && line.find(',') != line.npos) decide_about_commas(line);
    if (is_blank(line)) return false;
    values_.resize(rows_ + 1);
    const auto wrong = parse_row(line, row_, values_[rows_]);
    if (!wrong.empty()) in_.fail_at_line(wrong);
    return true;
  }

  /// Puts the values of a line, one for each column, to `out`. What is wrong with it, or nothing.
  /// `copy` is room for a line.
  std::string parse_row(std::string_view line, std::string& copy, double* out) const {
    if (has_decimal_commas_.value_or(false)) {
      copy = line;
      std::ranges::replace(copy, ',', '.');
      line = copy;
    }
    const char* at = line.data();
    const char* const end = at + line.size();
    const auto skip = [&] {
      while (at != end && is_separator(*at)) ++at;
    };
    std::size_t count = 0;
    for (skip(); at != end; skip(), ++count) {
      if (count == columns_) return "this line has another number of values than those before";
      double real = 0;
      const auto [rest, error] = std::from_chars(at, end, real);
      if (error != std::errc{} || (rest != end && !is_separator(*rest))) {
        // The rare forms: a plus sign, or what is too small or too large.
        word_reader words{{at, static_cast<std::size_t>(end - at)}, true};
        const auto word = words.next();
        if (!detail::parse_number(word, real) && !is_skipped(count))
          return "\"" + std::string{word.substr(0, 40)} + "\" is no number";
        at = word.data() + word.size();
      } else {
        at = rest;
      }
      out[count] = real;
    }
    if (count < columns_) return "this line has another number of values than those before";
    return {};
  }

  static bool is_blank(std::string_view line) { return std::ranges::all_of(line, is_separator); }

  static bool is_separator(char c) {
    return c == ' ' || c == ',' || c == '\t' || c == ';' || c == '\r' || c == '\v' || c == '\f';
  }

  static std::size_t columns_with_decimal_commas(std::string_view line) {
    if (line.find(';') == line.npos) return words_between_blanks(line).size();
    return static_cast<std::size_t>(std::ranges::count(line, ';')) + !line.ends_with(';');
  }

  /// By the first line of a point that has commas: they are decimal where semicolons separate, and
  /// where blanks do between numbers that all have one. Fails where they may be either.
  void decide_about_commas(std::string_view line) {
    has_decimal_commas_ = options_.decimal_commas;
    if (has_decimal_commas_) return;
    if (line.find(';') != line.npos) {
      has_decimal_commas_ = true;
      return;
    }
    const auto words = words_between_blanks(line);
    std::size_t with_comma = 0, without = 0;
    for (std::size_t i = 0; i < words.size(); ++i) {
      if (has_decimal_comma(words[i]))
        ++with_comma;
      else if (!is_skipped(i) && is_number(words[i]))
        ++without;
      else if (!is_skipped(i))
        return void(has_decimal_commas_ = false);
    }
    const bool are_points = words.size() >= (columns_ > 0 ? columns_ : std::size_t(D));
    if (with_comma > 0 && without > 0 && are_points && options_.columns.empty() && names_.empty() &&
        columns_ == 0)
      in_.fail_at_line(
          "commas may separate here or be decimal: say which by the option decimal_commas");
    const std::size_t named = !options_.columns.empty() ? options_.columns.size() : names_.size();
    has_decimal_commas_ =
        with_comma > 0 && words.size() > 1 && are_points && (named == 0 || named == words.size());
  }

  /// Whether the caller does not want a column, which may then hold words.
  [[nodiscard]] bool is_skipped(std::size_t column) const {
    return column < options_.columns.size() && options_.columns[column] == "_";
  }

  /// Up to the first point: the count, names, and how many columns there are.
  bool take_first_row(std::string_view line) {
    const auto words = words_of(line);
    if (words.empty()) return false;
    if (words.size() > most_columns) in_.fail_at_line("there are more than 4096 values in a line");
    if (!count_ && take_count(words)) return false;
    // Where the caller has named the columns, what the file calls them does not matter.
    const bool is_head =
        options_.columns.empty() ? are_names<D>(words) : std::ranges::none_of(words, is_number);
    if (is_head && names_.empty()) {
      names_ = words;
      return false;
    }
    if (line.find(',') != line.npos) decide_about_commas(line);
    columns_ =
        has_decimal_commas_.value_or(false) ? columns_with_decimal_commas(line) : words.size();
    values_.reset(columns_);
    return take_row(line);
  }

  static bool is_byte(double v) { return v >= 0 && v <= 255 && v == std::floor(v); }

  /// Whether columns `first` to `first + 2` are whole numbers from 0 to 255, and, unless that does
  /// not matter, not all 0 or 1.
  [[nodiscard]] bool are_bytes(std::size_t first, bool must_exceed_one = true) const {
    bool exceeds_one = !must_exceed_one;
    for (index_t i = 0; i < rows_; ++i)
      for (std::size_t c = first; c < first + 3; ++c) {
        const double v = value(i, c);
        if (!is_byte(v)) return false;
        exceeds_one = exceeds_one || v > 1;
      }
    return exceeds_one;
  }

  [[nodiscard]] names usual_names() const {
    names all{"x", "y", "z"};
    all.resize(D);
    const names normals = D == 2 ? names{"nx", "ny"} : names{"nx", "ny", "nz"};
    const names colors{"r", "g", "b"};
    const auto add = [&](const names& more) { all.insert(all.end(), more.begin(), more.end()); };
    switch (columns_ - std::min<std::size_t>(columns_, D)) {
      case 1:
        add({"intensity"});
        break;
      case 2:
        if (D == 2) add(normals);
        break;
      case 3:
        // PTS files have no normals.
        if (D == 3) add(count_ || are_bytes(D) ? colors : normals);
        if (D == 2 && are_bytes(D)) add(colors);
        break;
      case 4:
        if (!count_ && are_bytes(D)) {
          add(colors);
          add({"alpha"});
        } else {
          add({"intensity"});
          add(colors);
        }
        break;
      case 6:
        if (D == 3) {
          add(are_bytes(D) ? colors : normals);
          add(are_bytes(D) ? normals : colors);
        }
        break;
      default:
        break;
    }
    while (all.size() < columns_) all.push_back("column_" + std::to_string(all.size() + 1));
    all.resize(columns_);
    return all;
  }

  /// The columns by what the caller, the file or custom says.
  std::vector<file_field> describe() {
    names all = options_.columns;
    if (!all.empty() && rows_ > 0 && all.size() != columns_)
      in_.fail_at_line("there are " + std::to_string(columns_) + " columns, and " +
                       std::to_string(all.size()) + " were named");
    if (all.empty()) {
      all = names_;
      // The last one, which stands before the points: others are of whoever wrote them.
      for (auto at = comments_.end(); all.empty() && at != comments_.begin();) {
        --at;
        if (auto words = words_of(*at);
            (words.size() == columns_ || rows_ == 0) && are_names<D>(words)) {
          all = std::move(words);
          comments_.erase(at);
          break;
        }
      }
      if (!all.empty() && rows_ > 0 && all.size() != columns_)
        in_.fail_at_line("there are " + std::to_string(columns_) + " columns, and " +
                         std::to_string(all.size()) + " names");
    }
    if (rows_ == 0) columns_ = all.empty() ? D : all.size();
    if (all.empty()) all = usual_names();
    std::vector<std::string_view> seen;
    for (const auto& name : all)
      if (name != "_") seen.push_back(name);
    if (const auto twice = repeated_name(std::move(seen)))
      in_.fail_at_line("the column \"" + std::string{twice->substr(0, 40)} + "\" comes twice");

    std::vector<file_field> fields;
    for (const auto& name : all) fields.push_back({name, number::float64, name == "_"});
    // Spelled out, as this library writes them, whole numbers are from 0 to 255 even if all are
    // dark; r, g and b of 0 and 1 are more likely to be pure colours.
    for (std::size_t c = 0; c + 2 < fields.size(); ++c) {
      const auto are = [&](std::string_view red, std::string_view green, std::string_view blue) {
        return same_name(fields[c].name, red) && same_name(fields[c + 1].name, green) &&
               same_name(fields[c + 2].name, blue);
      };
      if ((are("red", "green", "blue") && are_bytes(c, false)) ||
          (are("r", "g", "b") && are_bytes(c, !count_)))
        for (std::size_t i = c; i < c + 3; ++i) fields[i].type = number::uint8;
    }
    return fields;
  }

  byte_stream& in_;
  const text_read_options& options_;
  names names_;
  std::vector<std::string> comments_;
  std::optional<index_t> count_;
  std::size_t columns_ = 0;
  index_t rows_ = 0, rows_before_ = 0;
  std::uint64_t lines_ = 0;
  std::vector<file_field> fields_;
  std::optional<bool> has_decimal_commas_;  ///< Once a line with commas has told.
  std::string row_;
  number_rows values_;
};

template <Scalar S, int D>
point_cloud<S, D> read_stream(byte_stream& in, const text_read_options& options) {
  auto cloud = text_reader<S, D>{in, options}.read();
  watch(options.monitor, 1, 1);
  return cloud;
}

template <Scalar S, int D>
class text_source : public cloud_source<S, D> {
 public:
  text_source(const std::filesystem::path& path, const read_options& options)
      : file_{path},
        options_{.origin = options.origin, .threads = options.threads, .monitor = options.monitor},
        reader_{file_.stream(), options_} {}

  [[nodiscard]] std::optional<std::uint64_t> size() const override { return std::nullopt; }
  [[nodiscard]] bool guesses() const override { return true; }
  point_cloud<S, D> read(index_t count) override { return reader_.read(count, &this->agreement()); }

 private:
  open_file file_;
  text_read_options options_;
  text_reader<S, D> reader_;
};

}  // namespace

template <Scalar S, int D>
source_pointer<S, D> open_text(const std::filesystem::path& path, const read_options& options) {
  return std::make_unique<text_source<S, D>>(path, options);
}

template <Scalar S, int D>
  requires(D == 2 || D == 3)
point_cloud<S, D> read_text(const std::filesystem::path& path, const text_read_options& options) {
  return with_stream(path, [&](byte_stream& in) { return read_stream<S, D>(in, options); });
}

template <Scalar S, int D>
  requires(D == 2 || D == 3)
point_cloud<S, D> read_text(std::span<const std::byte> bytes, const std::filesystem::path& name,
                            const text_read_options& options) {
  return with_stream(bytes, name, [&](byte_stream& in) { return read_stream<S, D>(in, options); });
}

template <Scalar S, int D>
  requires(D == 2 || D == 3)
void write_text(const point_cloud<S, D>& cloud, const std::filesystem::path& path,
                const text_write_options& options) {
  expect_consistent(cloud, "write_text");
  const char separator = options.separator;
  const bool is_space = separator == ' ' || separator == '\t';
  expects(is_space || separator == ',' || separator == ';',
          "write_text: the separator must be a space, a tab, a comma or a semicolon");
  const auto columns = columns_of(cloud, {});
  expect_writable_names(columns, "write_text", ",;\"");
  for (const auto& column : columns)
    expects(column.name != "_", "write_text: the attribute \"_\" would be skipped on reading");
  with_output(path, [&](detail::output_file& file) {
    const auto put = [&](std::string_view text) { file.write(text.data(), text.size()); };
    std::string head;
    if (is_space) {
      auto comments = cloud.comments;
      if (cloud.has_origin()) comments.push_back(origin_comment<D>(cloud.origin));
      if (cloud.is_organized()) comments.push_back(size_comment(cloud.width, cloud.height));
      for (std::string comment : comments) {
        std::ranges::replace_if(comment, [](char c) { return c == '\n' || c == '\r'; }, ' ');
        head += "# " + comment + '\n';
      }
    }
    if (options.names) {
      if (is_space) head += "# ";
      for (const auto& c : columns) head += c.name + separator;
      head.back() = '\n';
    }
    put(head);
    encode_text(columns, cloud.size(), separator, options.monitor, put);
  });
}

template <Scalar S>
void write_pts(const point_cloud<S, 3>& cloud, const std::filesystem::path& path,
               const task_monitor& monitor) {
  expect_consistent(cloud, "write_pts");
  auto columns = columns_of(cloud, {});
  const auto intensity = std::ranges::find(columns, "intensity", &file_column::name);
  const bool has_intensity = intensity != columns.end();
  expects(!cloud.has_normals() && cloud.attributes.size() == (has_intensity ? 1u : 0u),
          "write_pts: a PTS file has no place for normals or for attributes other than intensity");
  if (has_intensity) std::rotate(columns.begin() + 3, intensity, columns.end());
  with_output(path, [&](detail::output_file& file) {
    const auto put = [&](std::string_view text) { file.write(text.data(), text.size()); };
    put(std::to_string(cloud.size()) + '\n');
    encode_text(columns, cloud.size(), ' ', monitor, put);
  });
}

#define CILANTRO_INSTANTIATE(S, D)                                                            \
  template source_pointer<S, D> open_text(const std::filesystem::path&, const read_options&); \
  template point_cloud<S, D> read_text<S, D>(const std::filesystem::path&,                    \
                                             const text_read_options&);                       \
  template point_cloud<S, D> read_text<S, D>(                                                 \
      std::span<const std::byte>, const std::filesystem::path&, const text_read_options&);    \
  template void write_text(const point_cloud<S, D>&, const std::filesystem::path&,            \
                           const text_write_options&);
CILANTRO_INSTANTIATE(float, 2)
CILANTRO_INSTANTIATE(float, 3)
CILANTRO_INSTANTIATE(double, 2)
CILANTRO_INSTANTIATE(double, 3)
#undef CILANTRO_INSTANTIATE
template void write_pts(const point_cloud<float, 3>&, const std::filesystem::path&,
                        const task_monitor&);
template void write_pts(const point_cloud<double, 3>&, const std::filesystem::path&,
                        const task_monitor&);

}  // namespace cilantro
