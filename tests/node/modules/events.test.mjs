// Tests of the alert filter and of the unacknowledged contacts.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { AlertFilter, countKinds } from '../../../src/display/view/page/alert_filter.js';
import { Contacts } from '../../../src/display/view/page/contacts.js';

const contact = (time_s) => ({ run_id: 1, time_s, benches: [0, 8], clearance_m: 0 });

test('a contact stays until it is acknowledged, also on a reloaded page', () => {
  const contacts = new Contacts('');
  contacts.take(contact(412.47));
  contacts.take(contact(412.47));
  contacts.take(contact(413));
  assert.equal(contacts.waiting().contacts.length, 2);
  const kept = contacts.acknowledge();
  assert.equal(contacts.waiting().contacts.length, 0);
  const again = new Contacts(kept);
  again.take(contact(412.47));
  again.take(contact(414));
  assert.deepEqual(
    again.waiting().contacts.map(({ time_s }) => time_s),
    [414],
  );
});

test('contacts beyond the limit are counted', () => {
  const contacts = new Contacts('');
  for (let at = 0; at < 60; at += 1) contacts.take(contact(at));
  const { contacts: waiting, left_out } = contacts.waiting();
  assert.equal(waiting.length + left_out, 60);
});

test('kinds of alerts can be hidden, and the severe ones come first', () => {
  const alerts = [...Array(73).fill({ kind: 'near' }), { kind: 'contact' }];
  assert.deepEqual(countKinds(alerts), [
    ['contact', 1],
    ['near', 73],
  ]);
  const filter = new AlertFilter();
  filter.toggle('near');
  assert.deepEqual(filter.listed(alerts), [{ kind: 'contact' }]);
  filter.toggle('near');
  assert.equal(filter.listed(alerts).length, 74);
});
