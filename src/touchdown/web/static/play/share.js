// Hands a link on: to the clipboard, or to what a phone offers.

/**
 * @param {string} link
 * @returns {Promise<string>} what happened, in words
 */
export async function copyLink(link) {
  const onPhone = matchMedia("(pointer: coarse)").matches && location.protocol !== "file:";
  if (onPhone && navigator.share) {
    try {
      await navigator.share({ title: document.title, url: link });
      return "Shared.";
    } catch (error) {
      if (error instanceof DOMException && error.name === "AbortError") return "Not shared.";
      // not allowed here: the clipboard is left
    }
  }
  try {
    await navigator.clipboard.writeText(link);
    return "The link to this flight is copied.";
  } catch {
    return "The address of this page is the link to this flight.";
  }
}
