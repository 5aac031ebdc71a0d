// The page under a path of a proxy that removes the path, as nginx does.
//
//     node page_behind_proxy.mjs URL

import { once } from 'node:events';
import http from 'node:http';
import net from 'node:net';

import { expect, openPage, reads, say, stands, withBrowser } from './browser.mjs';

const PREFIX = '/dragon';
const view = new URL(process.argv[2]);

const proxy = http.createServer((request, response) => {
  if (!request.url.startsWith(`${PREFIX}/`)) return response.writeHead(404).end();
  const { method, headers } = request;
  const forwarded = http.request(
    { host: view.hostname, port: view.port, path: request.url.slice(PREFIX.length), method, headers },
    (reply) => {
      response.writeHead(reply.statusCode, reply.headers);
      reply.pipe(response);
    },
  );
  request.pipe(forwarded);
});
proxy.on('upgrade', (request, socket, head) => {
  const lines = request.rawHeaders.map((text, i) => (i % 2 === 0 ? `${text}: ` : `${text}\r\n`)).join('');
  const upstream = net.connect(Number(view.port), view.hostname, () => {
    upstream.write(`GET ${request.url.slice(PREFIX.length)} HTTP/1.1\r\n${lines}\r\n`);
    upstream.write(head);
    upstream.pipe(socket).pipe(upstream);
  });
  for (const end of [socket, upstream]) end.on('error', () => [socket, upstream].forEach((each) => each.destroy()));
});
proxy.listen(0, '127.0.0.1');
await once(proxy, 'listening');

await withBrowser(async (browser) => {
  const { page, complaints } = await openPage(
    browser,
    `http://127.0.0.1:${proxy.address().port}${PREFIX}/${view.hash}`,
  );
  await stands(page, 'running');
  await page.keyboard.press('h');
  await reads(page, '#reply', /^held from tick \d+$/);
  await stands(page, 'held');
  say({ type: 'held' });
  expect(complaints.length === 0, complaints.join('\n'));
});
proxy.close();
proxy.closeAllConnections();
