// Serves the playground: node serve.js [PORT]
import {serve} from './package/test/browser.js';
import {siteFolder} from './playground/build.js';

const {url} = await serve({'/': siteFolder}, Number(process.argv[2] ?? 8080));
console.log(`${url}/   (Ctrl+C ends it)`);
