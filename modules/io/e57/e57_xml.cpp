// SPDX-License-Identifier: MIT
#include "io/e57/e57_xml.hpp"

#include <algorithm>
#include <charconv>
#include <cstddef>
#include <string>
#include <string_view>
#include <utility>

#include "io/common/byte_stream.hpp"

namespace cilantro::e57 {
namespace {

constexpr std::string_view spaces = " \t\r\n";
/// Deeper than any E57 file is, and little enough for a recursion.
constexpr int most_levels = 64;

class parser {
 public:
  parser(std::string_view text, std::uint64_t at) : text_{text}, at_{at} {}

  element root() {
    skip_misc();
    if (!text_.substr(next_).starts_with('<')) fail("there is no element");
    return read_element(0);
  }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    throw detail::failure{"the XML part is malformed: " + what, false, at_ + next_};
  }

  /// Whether the text goes on with `what`, which is then passed.
  bool take(std::string_view what) {
    if (!text_.substr(next_).starts_with(what)) return false;
    next_ += what.size();
    return true;
  }
  void expect(std::string_view what) {
    if (!take(what)) fail("\"" + std::string{what} + "\" is missing");
  }
  void skip_spaces() { next_ = std::min(text_.find_first_not_of(spaces, next_), text_.size()); }
  /// What comes before `end`, which is passed.
  std::string_view take_until(std::string_view end) {
    const auto found = text_.find(end, next_);
    if (found == text_.npos) fail("\"" + std::string{end} + "\" is missing");
    const auto before = text_.substr(next_, found - next_);
    next_ = found + end.size();
    return before;
  }

  /// Declarations and comments before the root.
  void skip_misc() {
    for (;;) {
      skip_spaces();
      if (take("<?"))
        take_until("?>");
      else if (take("<!--"))
        take_until("-->");
      else if (take("<!"))
        fail("it declares types");
      else
        return;
    }
  }

  std::string take_name() {
    const auto end = std::min(text_.find_first_of(" \t\r\n=/><", next_), text_.size());
    if (end == next_) fail("a name is missing");
    const auto name = text_.substr(next_, end - next_);
    next_ = end;
    return std::string{name};
  }

  element read_element(int level) {
    if (level > most_levels) fail("elements are nested too deeply");
    expect("<");
    element e{.name = take_name()};
    for (;;) {
      skip_spaces();
      if (take("/>")) return e;
      if (take(">")) break;
      auto name = take_name();
      skip_spaces();
      expect("=");
      skip_spaces();
      const bool is_single = take("'");
      if (!is_single) expect("\"");
      e.attributes.emplace_back(std::move(name), plain(take_until(is_single ? "'" : "\"")));
    }
    read_content(e, level);
    return e;
  }

  void read_content(element& e, int level) {
    for (;;) {
      const auto next = text_.find('<', next_);
      if (next == text_.npos) fail("the element " + e.name + " does not end");
      e.text += plain(text_.substr(next_, next - next_));
      next_ = next;
      if (take("</")) {
        if (take_name() != e.name) fail("the element " + e.name + " ends under another name");
        skip_spaces();
        expect(">");
        return;
      }
      if (take("<!--"))
        take_until("-->");
      else if (take("<![CDATA["))
        e.text += take_until("]]>");
      else if (take("<?"))
        take_until("?>");
      else
        e.children.push_back(read_element(level + 1));
    }
  }

  /// Text with its references resolved; what is unknown stays as it is.
  static std::string plain(std::string_view text) {
    static constexpr std::pair<std::string_view, char> known[] = {
        {"&lt;", '<'}, {"&gt;", '>'}, {"&amp;", '&'}, {"&quot;", '"'}, {"&apos;", '\''}};
    std::string result;
    while (!text.empty()) {
      const auto found = std::ranges::find_if(
          known, [&](const auto& reference) { return text.starts_with(reference.first); });
      const bool is_known = found != std::end(known);
      result += is_known ? found->second : text.front();
      text.remove_prefix(is_known ? found->first.size() : 1);
    }
    return result;
  }

  std::string_view text_;
  std::uint64_t at_;
  std::size_t next_ = 0;
};

}  // namespace

const element* element::child(std::string_view wanted) const {
  const auto found = std::ranges::find(children, wanted, &element::name);
  return found == children.end() ? nullptr : &*found;
}

std::string_view element::attribute(std::string_view wanted) const {
  for (const auto& [key, value] : attributes)
    if (key == wanted) return value;
  return {};
}

element parse_xml(std::string_view text, std::uint64_t at) {
  return parser{text, at}.root();
}

}  // namespace cilantro::e57
