#pragma once

#include <string>

#include "client/report/listing.h"

namespace legopt::client {

/// Renders a listing in RenderListing's text format.
std::string RenderListingText(const Listing& listing, const TextLayout& layout);

}  // namespace legopt::client
