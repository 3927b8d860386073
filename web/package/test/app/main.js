// A user's app: imports both builds of the package by name.
import * as plain from 'ist-query';
import * as compat from 'ist-query/compat';

async function volume(ist) {
  await ist.init();
  const asset = ist.Asset.from(await (await fetch('asset.ist')).arrayBuffer(), 'asset.ist');
  return ist.penetration(asset, asset, {translation: [0.5, 0, 0]}).volume;
}

const tell = async () => [await volume(plain), await volume(compat)];
tell().then(
    (told) => {
      window.told = told;
    },
    (error) => {
      window.told = String(error);
    });
