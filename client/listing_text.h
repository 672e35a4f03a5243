#pragma once

#include <string>

#include "client/listing.h"

namespace legopt::client {

/// RenderListing for text.
std::string RenderListingText(const Listing& listing, const TextLayout& layout);

}  // namespace legopt::client
