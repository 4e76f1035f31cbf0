// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/view/access.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <random>

#include "waymark/base/text.h"

namespace waymark {
namespace {

/// Takes a time that does not depend on where the texts differ.
bool is_equal(std::string_view a, std::string_view b) {
  if (a.size() != b.size()) return false;
  unsigned difference = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    difference |= static_cast<unsigned char>(a[i]) ^ static_cast<unsigned char>(b[i]);
  }
  return difference == 0;
}

bool is_equal_name(std::string_view a, std::string_view b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](unsigned char x, unsigned char y) {
    return std::tolower(x) == std::tolower(y);
  });
}

/// The host of HOST[:PORT], in brackets where it has them; nothing for what is neither.
std::string_view without_port(std::string_view host) {
  const std::size_t end =
      host.starts_with('[') ? host.find(']') + 1 : std::min(host.find(':'), host.size());
  const std::string_view rest = host.substr(end);
  const bool is_port = rest.starts_with(':') && std::ranges::all_of(rest.substr(1), is_digit);
  return rest.empty() || is_port ? host.substr(0, end) : std::string_view();
}

}  // namespace

std::string make_token() {
  // Not for results, which depend on Rng alone: nobody may guess it.
  std::random_device device;
  std::string token;
  for (int i = 0; i < 4; ++i) token += fmt::format("{:08x}", device());
  return token;
}

std::string_view query_parameter(std::string_view target, std::string_view name) {
  const std::size_t question = target.find('?');
  if (question == std::string_view::npos) return {};
  std::string_view rest = target.substr(question + 1);
  while (!rest.empty()) {
    const std::string_view pair = rest.substr(0, rest.find('&'));
    rest.remove_prefix(std::min(rest.size(), pair.size() + 1));
    if (pair.size() > name.size() && pair.starts_with(name) && pair[name.size()] == '=') {
      return pair.substr(name.size() + 1);
    }
  }
  return {};
}

bool is_host_allowed(const AccessRules& rules, std::string_view host) {
  if (!rules.is_loopback) return true;
  constexpr std::array<std::string_view, 3> kNames = {"127.0.0.1", "localhost", "[::1]"};
  return std::ranges::any_of(
      kNames, [&](std::string_view name) { return is_equal_name(without_port(host), name); });
}

bool is_session_allowed(const AccessRules& rules,
                        std::string_view target,
                        std::string_view host,
                        std::string_view origin) {
  if (!is_host_allowed(rules, host)) return false;
  if (!rules.is_loopback && !is_equal(query_parameter(target, "token"), rules.token)) return false;
  if (origin.empty()) return true;
  constexpr std::string_view kScheme = "http://";
  return origin.starts_with(kScheme) && is_equal_name(origin.substr(kScheme.size()), host);
}

}  // namespace waymark
