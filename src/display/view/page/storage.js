// @ts-check
// The page's storage in the browser. If the user has blocked site data, values last until the page is closed.

/** @typedef {{read: () => string | null, write: (text: string) => void}} Kept */

/** A value of this tab, until it is closed. @param {string} key */
export function ofTab(key) {
  return kept(() => sessionStorage, key);
}

/** A value of this browser. @param {string} key */
export function ofBrowser(key) {
  return kept(() => localStorage, key);
}

/** @param {() => Storage} storage may throw @param {string} key @returns {Kept} */
function kept(storage, key) {
  /** @type {string | null} */ let here = null;
  return {
    read() {
      try {
        return here ?? storage().getItem(key);
      } catch {
        return here;
      }
    },
    write(text) {
      here = text;
      try {
        storage().setItem(key, text);
      } catch {
        // The value is still in `here`.
      }
    },
  };
}
