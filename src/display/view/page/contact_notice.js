// @ts-check
// The notice of unacknowledged contacts. The tab's storage keeps the acknowledgements.

import { Contacts } from './contacts.js';
import { element, write } from './element.js';
import * as format from './format.js';
import { ofTab } from './storage.js';

/** @typedef {import('./contacts.js').Contact} Contact */

const kept = ofTab('bench-dragon.acknowledged');
const contacts = new Contacts(kept.read() ?? '');
const notice = element('contacts', HTMLElement);
const text = element('contacts-text', HTMLElement);

element('acknowledge', HTMLButtonElement).addEventListener('click', () => {
  kept.write(contacts.acknowledge());
  writeNotice();
});

/** Whether a contact is unacknowledged. */
export function hasContact() {
  return !notice.hidden;
}

/** @param {Contact} contact */
export function noticeContact(contact) {
  contacts.take(contact);
  writeNotice();
}

function writeNotice() {
  const { contacts: waiting, left_out } = contacts.waiting();
  notice.hidden = waiting.length === 0;
  if (waiting.length === 0) return;
  const [first] = waiting;
  const { benches, dragons, indices } = first;
  const who = benches === null ? 'boards' : format.pair({ benches, dragons, indices });
  const more = waiting.length + left_out - 1;
  write(
    text,
    `Contact: ${who} at ${format.showTime(first.time_s)} s${more === 0 ? '' : `, and ${more} more`}`,
  );
}
