// @ts-check
// What a browser keeps for the page, where it lets it: with site data blocked, it is kept for as long as the page is open.

/** @typedef {{read: () => string | null, write: (text: string) => void}} Kept */

/** Of this tab, until it is closed. @param {string} key */
export function ofTab(key) {
  return kept(() => sessionStorage, key);
}

/** Of this browser. @param {string} key */
export function ofBrowser(key) {
  return kept(() => localStorage, key);
}

/** @param {() => Storage} storage to ask for it may throw already @param {string} key @returns {Kept} */
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
        // It is here.
      }
    },
  };
}
