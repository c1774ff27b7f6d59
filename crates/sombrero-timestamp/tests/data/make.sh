#!/bin/sh
# Makes all files of this folder anew, with OpenSSL 3. The keys stay in a temporary folder and are gone at the end.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"

cat > settings <<'END'
[request]
distinguished_name = name
[name]
[root]
basicConstraints = critical, CA:TRUE
keyUsage = critical, keyCertSign, cRLSign
subjectKeyIdentifier = hash
[intermediate]
basicConstraints = critical, CA:TRUE, pathlen:0
keyUsage = critical, keyCertSign, cRLSign
subjectKeyIdentifier = hash
authorityKeyIdentifier = keyid
[tsa]
basicConstraints = critical, CA:FALSE
keyUsage = critical, digitalSignature
extendedKeyUsage = critical, timeStamping
subjectKeyIdentifier = hash
authorityKeyIdentifier = keyid
[self]
basicConstraints = critical, CA:FALSE
keyUsage = critical, digitalSignature
extendedKeyUsage = critical, timeStamping
subjectKeyIdentifier = hash
[nousage]
basicConstraints = critical, CA:FALSE
keyUsage = critical, digitalSignature
[uncritical]
basicConstraints = critical, CA:FALSE
extendedKeyUsage = timeStamping
[twousages]
basicConstraints = critical, CA:FALSE
extendedKeyUsage = critical, timeStamping, codeSigning
[database]
database = index
serial = number
new_certs_dir = .
default_md = sha256
policy = anything
[anything]
commonName = supplied
organizationName = optional
END

# key <name> <kind>
key() {
    case $2 in
        rsa) openssl genpkey -quiet -algorithm RSA -pkeyopt rsa_keygen_bits:2048 -out "$1.key" ;;
        *) openssl genpkey -quiet -algorithm EC -pkeyopt "ec_paramgen_curve:$2" -out "$1.key" ;;
    esac
}
# own <name> <extensions> <subject>: a certificate signed by its own key
own() {
    openssl req -new -x509 -config settings -extensions "$2" -key "$1.key" -sha256 -days 36500 -subj "$3" -out "$1.pem"
}
# issue <name> <issuer> <extensions> <subject> [hash]
issue() {
    openssl req -new -config settings -key "$1.key" -subj "$4" -out "$1.csr"
    openssl x509 -req -in "$1.csr" -CA "$2.pem" -CAkey "$2.key" -CAcreateserial "-${5:-sha256}" -days 36500 \
        -extfile settings -extensions "$3" -out "$1.pem" 2> "$1.log"
}
# authority <name> <signer> <others> <signature hash> <hash that names the certificate> <fraction digits> [digests]
authority() {
    cat > "$1.cnf" <<END
[tsa]
default_tsa = use
[use]
serial = $1.serial
signer_cert = $2.pem
certs = $3
signer_key = $2.key
signer_digest = $4
default_policy = 1.3.6.1.4.1.99999.1
digests = ${7:-sha256, sha512}
accuracy = secs:1, millisecs:500, microsecs:100
clock_precision_digits = $6
tsa_name = yes
ess_cert_id_chain = no
ess_cert_id_alg = $5
END
    echo 0ABC > "$1.serial"
}
# reply <request> <authority> <result>
reply() { openssl ts -reply -config "$2.cnf" -queryfile "$1" -out "$here/$3" 2> "$3.log"; }
# sign <result> <signer> [options]: the contents of rsa.tsr under another signature
sign() {
    result=$1; signer=$2; shift 2
    openssl cms -sign -binary -nodetach -nosmimecap -md sha256 -econtent_type 1.2.840.113549.1.9.16.1.4 -in content.der \
        -signer "$signer.pem" -inkey "$signer.key" -certfile rsa-chain.pem -outform DER -out "$here/$result" "$@"
}

# Two hierarchies: root, intermediate, authority.
for kind in rsa P-256; do
    name=$(echo "$kind" | sed 's/P-256/ec/')
    for part in root intermediate tsa; do key "$name-$part" "$kind"; done
    own "$name-root" root "/O=Sombrero test/CN=$name root"
    issue "$name-intermediate" "$name-root" intermediate "/O=Sombrero test/CN=$name intermediate"
    issue "$name-tsa" "$name-intermediate" tsa "/O=Sombrero test/CN=$name authority"
    cat "$name-intermediate.pem" "$name-root.pem" > "$name-chain.pem"
    cp "$name-root.pem" "$here/"
done
key p384-tsa P-384
issue p384-tsa ec-intermediate tsa "/O=Sombrero test/CN=p384 authority"
# The name of the root, but not its key.
key impostor-root rsa
own impostor-root root "/O=Sombrero test/CN=rsa root"
cp impostor-root.pem "$here/"

# Certificates that nobody should accept. All are made before the first stamp, so that they are valid by then.
for kind in nousage uncritical twousages; do
    key "$kind" rsa
    issue "$kind" rsa-intermediate "$kind" "/O=Sombrero test/CN=$kind"
done
# For time stamps, but from one who may not issue certificates.
key leaf rsa
issue leaf rsa-tsa tsa "/O=Sombrero test/CN=issued by an authority"
cat rsa-tsa.pem rsa-intermediate.pem > leaf-chain.pem
# Expired long before.
key expired rsa
openssl req -new -config settings -key expired.key -subj "/O=Sombrero test/CN=expired" -out expired.csr
: > index; echo 01 > number
openssl ca -batch -notext -config settings -name database -cert rsa-intermediate.pem -keyfile rsa-intermediate.key \
    -startdate 20000101000000Z -enddate 20010101000000Z -extfile settings -extensions tsa \
    -in expired.csr -out expired.pem 2> log
# Valid itself, but its issuer had expired long before.
key old-intermediate rsa
openssl req -new -config settings -key old-intermediate.key -subj "/O=Sombrero test/CN=old intermediate" \
    -out old-intermediate.csr
openssl ca -batch -notext -config settings -name database -cert rsa-root.pem -keyfile rsa-root.key \
    -startdate 20000101000000Z -enddate 20010101000000Z -extfile settings -extensions intermediate \
    -in old-intermediate.csr -out old-intermediate.pem 2> log
key heir rsa
issue heir old-intermediate tsa "/O=Sombrero test/CN=heir"
cat old-intermediate.pem rsa-root.pem > old-chain.pem
# Issued with a SHA-1, which can be made to collide.
key weak rsa
issue weak rsa-intermediate tsa "/O=Sombrero test/CN=weak" sha1
# Issued by nobody else.
key self rsa
own self self "/O=Sombrero test/CN=nobody"
cp self.pem "$here/"

printf 'a sombrero key' > key
openssl ts -query -data key -sha256 -cert -out key.tsq 2> log
openssl ts -query -data key -sha512 -cert -out sha512.tsq 2> log
printf 'another key' > other
openssl ts -query -data other -sha256 -cert -out other.tsq 2> log
openssl ts -query -data key -sha256 -out nocert.tsq 2> log
openssl ts -query -data key -sha1 -cert -out sha1.tsq 2> log
openssl ts -query -data key -md5 -cert -out md5.tsq 2> log

authority rsa rsa-tsa rsa-chain.pem sha256 sha256 0
authority rsa512 rsa-tsa rsa-chain.pem sha512 sha1 0
authority rsa384 rsa-tsa rsa-chain.pem sha384 sha512 0
authority ec ec-tsa ec-chain.pem sha256 sha256 6
authority ec512 ec-tsa ec-chain.pem sha512 sha256 0
authority p384 p384-tsa ec-chain.pem sha384 sha384 0
authority lax rsa-tsa rsa-chain.pem sha256 sha256 0 "sha1, md5"
authority rsa1 rsa-tsa rsa-chain.pem sha1 sha256 0
reply key.tsq rsa rsa.tsr
reply key.tsq rsa512 rsa-sha512.tsr
reply key.tsq rsa384 rsa-sha384.tsr
reply key.tsq ec ec.tsr
reply key.tsq ec512 ec-sha512.tsr
reply key.tsq p384 p384.tsr
reply other.tsq rsa other-digest.tsr
reply sha512.tsq rsa other-hash.tsr
reply sha1.tsq lax sha1-digest.tsr
reply md5.tsq lax md5-digest.tsr
reply key.tsq rsa1 rsa-sha1.tsr
reply nocert.tsq rsa no-certificate.tsr
# A hash that the authority does not take.
reply sha1.tsq rsa rejected.tsr || true

authority self self self.pem sha256 sha256 0
reply key.tsq self self-signed.tsr

# What no authority of OpenSSL signs is signed as mere CMS.
openssl ts -reply -in "$here/rsa.tsr" -token_out -out token.der 2> log
openssl cms -verify -noverify -inform DER -in token.der -binary -out content.der 2> log
for kind in nousage uncritical twousages expired weak; do sign "$kind.der" "$kind" -cades; done
sign leaf.der leaf -cades -certfile leaf-chain.pem
sign heir.der heir -cades -certfile old-chain.pem
sign pss.der rsa-tsa -cades -keyopt rsa_padding_mode:pss -keyopt rsa_pss_saltlen:32
sign key-identifier.der rsa-tsa -cades -keyid
sign unnamed-certificate.der rsa-tsa
sign no-attributes.der rsa-tsa -noattr
sign two-signatures.der rsa-tsa -cades -signer nousage.pem -inkey nousage.key
openssl cms -sign -binary -nodetach -md sha256 -in content.der -cades -signer rsa-tsa.pem -inkey rsa-tsa.key \
    -certfile rsa-chain.pem -outform DER -out "$here/not-a-stamp.der"

# Contents that no authority of OpenSSL makes: an extension that must be understood, a negative number, no nonce.
cat > contents.cnf <<END
asn1 = SEQUENCE:contents
[contents]
version = INTEGER:1
policy = OID:1.3.6.1.4.1.99999.1
imprint = SEQUENCE:imprint
serial = INTEGER:-5
time = GENERALIZEDTIME:20300101000000Z
extensions = IMPLICIT:1,SEQUENCE:extensions
[imprint]
algorithm = SEQUENCE:algorithm
digest = FORMAT:HEX,OCTETSTRING:$(openssl dgst -sha256 -r key | cut -d ' ' -f 1)
[algorithm]
name = OID:sha256
[extensions]
only = SEQUENCE:extension
[extension]
name = OID:1.3.6.1.4.1.99999.7
critical = BOOLEAN:TRUE
value = FORMAT:HEX,OCTETSTRING:0500
END
openssl asn1parse -genconf contents.cnf -noout -out content.der
sign extension.der rsa-tsa -cades
