// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

namespace waymark {

/// Who may see and control a session. A page of another site, open in the same browser, must not:
/// its requests carry its own Origin, and a name that it makes point here (DNS rebinding) is not
/// one of ours.
struct AccessRules {
  bool is_loopback = true;  ///< Reached from this machine only; then no token is needed.
  std::string token;
};

/// A new token: 128 bits from the system's source of randomness, in hexadecimal digits.
std::string make_token();

/// The value of a query parameter of a request's target, as it stands there; empty if absent.
std::string_view query_parameter(std::string_view target, std::string_view name);

/// Whether a request may reach the server at all; host: its field Host.
bool is_host_allowed(const AccessRules& rules, std::string_view host);

/// Whether a request may see the session; origin: its field Origin, empty if absent.
bool is_session_allowed(const AccessRules& rules,
                        std::string_view target,
                        std::string_view host,
                        std::string_view origin);

}  // namespace waymark
