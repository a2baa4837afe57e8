// SPDX-License-Identifier: MIT
module;
#include <cerrno>

#include "io/common/byte_stream.hpp"
#include "io/common/file.hpp"
#include "io/common/number.hpp"
module cilantro.io;

import :file_scope;

namespace cilantro {
namespace {

using detail::byte_stream;
using detail::number;

constexpr std::string_view npy_magic = "\x93NUMPY";

/// What the header of an NPY file says.
struct npy_header {
  number type = number::float64;
  bool swap = false, by_columns = false;
  std::uint64_t rows = 1, columns = 1;
};

/// Reads the few forms of Python's dictionary that NumPy writes.
class npy_header_reader {
 public:
  npy_header_reader(byte_stream& in, std::string text) : in_{in}, text_{std::move(text)} {}

  npy_header read() {
    npy_header header;
    read_type(value_of("descr"), header);
    const auto order = value_of("fortran_order");
    if (!order.starts_with("True") && !order.starts_with("False"))
      in_.fail_at_byte("the header does not say in which order the numbers are");
    header.by_columns = order.starts_with("True");
    read_shape(value_of("shape"), header);
    return header;
  }

 private:
  [[nodiscard]] std::string_view value_of(const std::string& key) const {
    const std::string_view text = text_;
    auto at = text.find("'" + key + "'");
    if (at != text.npos) at = text.find(':', at);
    if (at != text.npos) at = text.find_first_not_of(' ', at + 1);
    if (at == text.npos) in_.fail_at_byte("the header has no \"" + key + "\"");
    return text.substr(at);
  }

  void read_type(std::string_view descr, npy_header& header) const {
    struct known {
      std::string_view name;
      number is;
    };
    constexpr known all[] = {
        {"i1", number::int8},    {"u1", number::uint8},  {"b1", number::uint8},
        {"i2", number::int16},   {"u2", number::uint16}, {"i4", number::int32},
        {"u4", number::uint32},  {"i8", number::int64},  {"u8", number::uint64},
        {"f4", number::float32}, {"f8", number::float64}};
    if (descr.size() < 5 || descr[0] != '\'' || descr[4] != '\'')
      in_.fail_at_byte("the numbers are of a type that is none of integers and floating numbers");
    const char order = descr[1];
    const auto name = descr.substr(2, 2);
    for (const auto& k : all)
      if (k.name == name && std::string_view{"<>|="}.find(order) != std::string_view::npos) {
        header.type = k.is;
        constexpr bool little = std::endian::native == std::endian::little;
        header.swap = (order == '<' && !little) || (order == '>' && little);
        return;
      }
    in_.fail_at_byte("the numbers are of a type that is none of integers and floating numbers");
  }

  void read_shape(std::string_view shape, npy_header& header) const {
    std::vector<std::uint64_t> sizes;
    const auto close = shape.find(')');
    if (!shape.starts_with('(') || close == shape.npos) in_.fail_at_byte("the header has no shape");
    detail::word_reader words{shape.substr(1, close - 1), true};
    for (auto word = words.next(); !word.empty(); word = words.next()) {
      std::uint64_t size = 0;
      if (!detail::parse_number(word, size)) in_.fail_at_byte("the shape has a size that is none");
      sizes.push_back(size);
    }
    if (sizes.size() > 2) in_.fail_at_byte("the array has more than two dimensions");
    if (!sizes.empty()) header.rows = sizes[0];
    if (sizes.size() == 2) header.columns = sizes[1];
  }

  byte_stream& in_;
  std::string text_;
};

template <Scalar S>
any_matrix<S> read_npy(byte_stream& in, const task_monitor& monitor) {
  in.take(npy_magic.size());
  const auto major = static_cast<unsigned char>(*in.take(2));
  if (major < 1 || major > 3) in.fail_at_byte("the version of the format is none of 1, 2 and 3");
  constexpr bool swap = std::endian::native == std::endian::big;
  const std::size_t length = major == 1 ? detail::load_number<std::uint16_t>(in.take(2), swap)
                                        : detail::load_number<std::uint32_t>(in.take(4), swap);
  if (length > std::min<std::uint64_t>(in.remaining(), 1u << 20))
    in.fail_at_byte("the header is not all there");
  const char* text = in.take(length);
  const auto header = npy_header_reader{in, {text, length}}.read();
  const std::size_t each = detail::size_of(header.type);
  if (header.columns != 0 && header.rows > in.remaining() / each / header.columns)
    in.fail_at_byte("the header promises more numbers than the file has bytes for");
  // An empty side is no reason to believe the other one.
  constexpr std::uint64_t largest = std::uint64_t{1} << 40;
  if (header.rows > largest || header.columns > largest)
    in.fail_at_byte("the header promises a size that no array has");

  const auto rows = static_cast<index_t>(header.rows),
             columns = static_cast<index_t>(header.columns);
  any_matrix<S> matrix(rows, columns);
  const auto read_in_order = [&](index_t outer, index_t inner, auto entry) {
    const auto at_a_time = std::min<index_t>(inner, 1 << 13);
    for (index_t o = 0; o < outer; ++o) {
      if (o % 1024 == 0) watch(monitor, double(o), double(outer));
      for (index_t first = 0; first < inner; first += at_a_time) {
        const index_t n = std::min(at_a_time, inner - first);
        const char* data = in.take(each * static_cast<std::size_t>(n));
        detail::visit_number(header.type, [&]<class T>(T) {
          for (index_t i = 0; i < n; ++i, data += sizeof(T))
            entry(o, first + i) = static_cast<S>(detail::load_number<T>(data, header.swap));
        });
      }
    }
  };
  if (header.by_columns)
    read_in_order(columns, rows, [&](index_t c, index_t r) -> S& { return matrix(r, c); });
  else
    read_in_order(rows, columns, [&](index_t r, index_t c) -> S& { return matrix(r, c); });
  watch(monitor, 1, 1);
  return matrix;
}

template <Scalar S>
any_matrix<S> read_rows(byte_stream& in, const task_monitor& monitor) {
  std::vector<S> values;
  index_t rows = 0, columns = 0;
  for (auto line = in.take_line(); line; line = in.take_line()) {
    if (rows % 1024 == 0) watch(monitor, double(in.position()), double(in.size()));
    detail::word_reader words{*line, true};
    index_t count = 0;
    for (auto word = words.next(); !word.empty(); word = words.next(), ++count) {
      if (count == 0 && word.front() == '#') break;
      S value;
      if (!detail::parse_number(word, value))
        in.fail_at_line("\"" + std::string{word.substr(0, 40)} + "\" is no number");
      values.push_back(value);
    }
    if (count == 0) continue;
    if (rows++ == 0) columns = count;
    if (count != columns) in.fail_at_line("this row has another number of values than the first");
  }
  watch(monitor, 1, 1);
  using by_rows = Eigen::Matrix<S, dynamic, dynamic, Eigen::RowMajor>;
  return Eigen::Map<const by_rows>{values.data(), rows, columns};
}

template <Scalar S>
any_matrix<S> read_either(byte_stream& in, const task_monitor& monitor) {
  return in.peek(npy_magic.size()) == npy_magic ? read_npy<S>(in, monitor)
                                                : read_rows<S>(in, monitor);
}

template <Scalar S>
std::string npy_header_of(index_t rows, index_t columns) {
  constexpr bool little = std::endian::native == std::endian::little;
  std::string dictionary = std::string{"{'descr': '"} + (little ? '<' : '>') + 'f' +
                           std::to_string(sizeof(S)) + "', 'fortran_order': True, 'shape': (" +
                           std::to_string(rows) + ", " + std::to_string(columns) + "), }";
  // The numbers begin at a multiple of 64 bytes, as the format asks.
  while ((npy_magic.size() + 4 + dictionary.size() + 1) % 64 != 0) dictionary += ' ';
  dictionary += '\n';
  std::string header{npy_magic};
  header += {'\x01', '\x00', static_cast<char>(dictionary.size() & 0xff),
             static_cast<char>(dictionary.size() >> 8)};
  return header + dictionary;
}

}  // namespace

template <Scalar S>
any_matrix<S> read_matrix(const std::filesystem::path& path, const task_monitor& monitor) {
  return with_stream(path, [&](byte_stream& in) { return read_either<S>(in, monitor); });
}

template <Scalar S>
any_matrix<S> read_matrix(std::span<const std::byte> bytes, const std::filesystem::path& name,
                          const task_monitor& monitor) {
  return with_stream(bytes, name, [&](byte_stream& in) { return read_either<S>(in, monitor); });
}

template <Scalar S>
void closed_write_matrix(const Eigen::Ref<const any_matrix<S>>& matrix,
                         const std::filesystem::path& path, matrix_format format,
                         const task_monitor& monitor) {
  with_output(path, [&](detail::output_file& file) {
    if (format == matrix_format::npy) {
      const auto header = npy_header_of<S>(matrix.rows(), matrix.cols());
      file.write(header.data(), header.size());
      for (index_t c = 0; c < matrix.cols(); ++c) {
        if (c % 1024 == 0) watch(monitor, double(c), double(matrix.cols()));
        file.write(reinterpret_cast<const char*>(matrix.data() + c * matrix.outerStride()),
                   sizeof(S) * static_cast<std::size_t>(matrix.rows()));
      }
    } else {
      std::array<char, 64> digits;
      std::string text;
      for (index_t r = 0; r < matrix.rows(); ++r) {
        if (r % 1024 == 0) watch(monitor, double(r), double(matrix.rows()));
        text.clear();
        for (index_t c = 0; c < matrix.cols(); ++c) {
          const auto end =
              std::to_chars(digits.data(), digits.data() + digits.size(), matrix(r, c)).ptr;
          text.append(digits.data(), end);
          text += c + 1 < matrix.cols() ? ' ' : '\n';
        }
        file.write(text.data(), text.size());
      }
    }
    watch(monitor, 1, 1);
  });
}

#define CILANTRO_INSTANTIATE(S)                                                                \
  template any_matrix<S> read_matrix(const std::filesystem::path&, const task_monitor&);       \
  template any_matrix<S> read_matrix(std::span<const std::byte>, const std::filesystem::path&, \
                                     const task_monitor&);                                     \
  template void closed_write_matrix(const Eigen::Ref<const any_matrix<S>>&,                    \
                                    const std::filesystem::path&, matrix_format,               \
                                    const task_monitor&);
CILANTRO_INSTANTIATE(float)
CILANTRO_INSTANTIATE(double)
#undef CILANTRO_INSTANTIATE

}  // namespace cilantro
