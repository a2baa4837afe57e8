// SPDX-License-Identifier: MIT
export module cilantro.core:error;

import cilantro.standard;

namespace cilantro {

/// The caller broke a documented precondition. Thrown before any output is touched.
export class invalid_input : public std::invalid_argument {
 public:
  using std::invalid_argument::invalid_argument;
};

/// Where in a file something went wrong.
export struct file_position {
  /// What `at` counts: `line` from 1 in a text file, or `byte` from 0.
  enum class unit { line, byte };
  unit in = unit::byte;  ///< Lines or bytes.
  std::uint64_t at = 0;  ///< The number of the line or byte.
};

/// A file is missing, malformed or truncated, or cannot be written.
export class io_error : public std::runtime_error {
 public:
  io_error(std::filesystem::path path, const std::string& what,
           std::optional<file_position> position = {})
      : std::runtime_error{sentence(path, what, position)},
        path_{std::move(path)},
        position_{position} {}

  /// The file concerned, as the caller named it.
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  /// The place in the file, if its content is at fault.
  [[nodiscard]] const std::optional<file_position>& position() const { return position_; }

 private:
  static std::string sentence(const std::filesystem::path& path, const std::string& what,
                              std::optional<file_position> position) {
    std::string text = path.string();
    if (position)
      text += (position->in == file_position::unit::line ? ", line " : ", byte ") +
              std::to_string(position->at);
    return text + ": " + what;
  }

  std::filesystem::path path_;
  std::optional<file_position> position_;
};

/// A long call was asked to stop through its `std::stop_token`. Its inputs are unchanged.
export class cancelled : public std::runtime_error {
 public:
  cancelled() : std::runtime_error{"the operation was cancelled"} {}
};

/// A number as text for messages, with as many digits as distinguish it from all other doubles.
export [[nodiscard]] std::string in_digits(double value);

/// Throws `invalid_input` unless `value` lies in the range, bounds included, with a message such as
/// "`what` must be 1 or more, and is 0". NaN is in no range.
export void expect_from(double least, double value, const char* what);
export void expect_between(double least, double value, double most, const char* what);

/// Throws `invalid_input{what}` unless `condition` holds.
export inline void expects(bool condition, const char* what) {
  if (!condition) throw invalid_input{what};
}
export inline void expects(bool condition, const std::string& what) {
  if (!condition) throw invalid_input{what};
}

}  // namespace cilantro
